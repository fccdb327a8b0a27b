// SPDX-License-Identifier: GPL-3.0-or-later
// hausdorff A B prints two numbers: the distance from the farthest point of A to B is proved to be between them.
#include <tolvol/measure/hausdorff.h>
#include <cstdlib>
#include <iostream>

#include "off.h"

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: hausdorff A B");
  const tolvol::HausdorffInterval distance = tolvol::hausdorff(read_off(argv[1]), read_off(argv[2]));
  std::cout << std::setprecision(17) << distance.lower << ' ' << distance.upper << '\n';
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return EXIT_FAILURE;
}
