// SPDX-License-Identifier: GPL-3.0-or-later
// Functions without side effects that enumerate the parts of a triangle which is split in four repeatedly, depth first and
// without a stack. A part is a number of `depth` digits to the base 4. Each digit names one of four parts: 0 is the middle
// one, 1 to 3 are at the corners.

struct Part {
  int depth;
  uint path;
};

const int kDeepest = 12;  // up to this depth the weights below are exact

// The middle part comes first, because it is the soonest to show that the whole is outside.
Part first_within(Part part) { return Part(part.depth + 1, part.path << 2); }

// Returns the part that comes after a part and all parts within it. It has depth 0 if that part was the last one.
Part next_after(Part part) {
  const uint path = part.path + 1;
  const int finished = min(findLSB(path) >> 1, part.depth);
  return Part(part.depth - finished, path >> (2 * finished));
}

// Returns the exact barycentric weights of the part's three corners (columns) for the corners of the whole triangle.
mat3 weights(Part part) {
  ivec2 at = ivec2(0);
  int side = 1;
  for (int level = part.depth - 1; level >= 0; --level) {
    const uint digit = part.path >> (2 * level) & 3u;
    at = 2 * at + side * ivec2(digit == 0 || digit == 2, digit == 0 || digit == 3);
    if (digit == 0) side = -side;
  }
  const ivec2 second = at + ivec2(side, 0), third = at + ivec2(0, side);
  const int whole = 1 << part.depth;
  // 1 / whole is computed from bits, because a division need not be exact.
  const float unit = uintBitsToFloat(uint(127 - part.depth) << 23);
  return unit * mat3(whole - at.x - at.y, at, whole - second.x - second.y, second, whole - third.x - third.y, third);
}
