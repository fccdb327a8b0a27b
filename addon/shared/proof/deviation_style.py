# SPDX-License-Identifier: GPL-3.0-or-later
"""The colours and the style sheet of the page of a deviation: for a window, for a telephone and for paper (A4).

The colours are from the palette of M. Okabe and K. Ito, which the colour-blind can tell apart.
"""

WITHIN, BEYOND, LINE = "#0072B2", "#D55E00", "#1a1a1a"

STYLE = f"""
:root {{ color-scheme: light; font: 15px/1.45 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #1a1a1a;
  -webkit-text-size-adjust: 100%; text-size-adjust: 100%; }}
* {{ -webkit-print-color-adjust: exact; print-color-adjust: exact; }}
body {{ max-width: 80rem; margin: 0 auto; padding: 2rem 1.5rem 3rem; background: #fff; overflow-wrap: anywhere; }}
h1 {{ font-size: 1.6rem; line-height: 1.25; margin: 0 0 .6rem; }}
h2 {{ font-size: 1.35rem; line-height: 1.25; margin: 0 0 .5rem; }}
h3 {{ font-size: 1.15rem; margin: 0 0 .6rem; }}
h4 {{ font-size: .95rem; margin: 0 0 .3rem; padding-top: 1.4rem; }}
p {{ margin: .3rem 0; }}
a {{ color: inherit; }}
.muted, th, dt, figcaption, footer {{ color: #555; font-weight: normal; }}
.facts {{ display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1.2rem; margin: .5rem 0; }}
.facts dd {{ margin: 0; }}
.verdict {{ width: fit-content; margin: .8rem 0; padding: .35rem .8rem; border-radius: .3rem; font-weight: 600;
  border: 2px solid #888; }}
.verdict.within {{ border-color: {WITHIN}; color: {WITHIN}; }}
.verdict.beyond {{ border-color: {BEYOND}; color: #a34700; }}
.within {{ color: {WITHIN}; font-weight: 600; }}
.beyond {{ color: #a34700; font-weight: 600; }}
section {{ border-top: 2px solid #1a1a1a; margin-top: 2.5rem; padding-top: 1rem; }}
.ways, .pictures {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(min(31rem, 100%), 1fr)); gap: 1.5rem;
  margin-top: 1rem; }}
article {{ min-width: 0; border: 1px solid #d0d0d0; border-radius: .5rem; padding: 1.1rem 1.3rem; }}
.largest {{ font-size: 1.9rem; font-weight: 600; line-height: 1.2; }}
.table {{ overflow-x: auto; max-width: 100%; }}
table {{ font-size: .93rem; border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }}
th, td {{ text-align: right; white-space: nowrap; padding: .16rem .35rem; border-bottom: 1px solid #ececec; }}
th {{ white-space: normal; vertical-align: bottom; }}
th, td {{ overflow-wrap: normal; }}
th:first-child, td:first-child {{ text-align: left; padding-left: 0; }}
.overview td:first-child {{ white-space: normal; overflow-wrap: anywhere; min-width: 7rem; }}
.measures table {{ width: auto; }}
svg {{ display: block; width: 100%; height: auto; max-width: 36rem; margin: 0 auto; }}
svg text {{ font-size: 12px; fill: #333; }}
figure {{ min-width: 0; margin: 0; }}
figure img {{ display: block; max-width: 100%; height: auto; margin: 0 auto; }}
figcaption {{ text-align: center; margin: .2rem 0 .3rem; }}
figure svg {{ max-width: 24rem; }}
footer {{ margin-top: 2rem; font-size: .87rem; border-top: 1px solid #d0d0d0; padding-top: .8rem; }}
@media (max-width: 40rem) {{
  body {{ padding: 1rem .8rem 2rem; }}
  h1 {{ font-size: 1.3rem; }}
  h2 {{ font-size: 1.2rem; }}
  article {{ padding: .8rem .7rem; }}
  .largest {{ font-size: 1.6rem; }}
  table {{ font-size: .8rem; }}
  th, td {{ padding: .16rem .2rem; white-space: normal; }}
  .overview td:not(:first-child), .measures td {{ white-space: nowrap; }}
  .facts {{ grid-template-columns: 1fr; }}
  .facts dd {{ margin-bottom: .25rem; }}
}}
@page {{ size: A4; margin: 14mm 12mm; }}
@media print {{
  :root {{ font-size: 9.5px; }}
  body {{ max-width: none; padding: 0; }}
  .ways, .pictures {{ grid-template-columns: 1fr 1fr; gap: 1rem; }}
  .table {{ overflow: visible; }}
  article {{ padding: .7rem .8rem; }}
  figure, figure img, svg, tr, .block, .verdict, .facts, .measures, .pictures {{ break-inside: avoid; }}
  h1, h2, h3, h4, thead, .largest {{ break-after: avoid; }}
  section + section {{ break-before: page; border-top: none; margin-top: 0; padding-top: 0; }}
  footer {{ break-inside: avoid; }}
}}
"""
