// SPDX-License-Identifier: GPL-3.0-or-later
// Pure functions: the parts of a triangle that is split in four again and again, walked depth first without a stack. A
// part is a number of `depth` digits to the base 4, each naming one of the four: 0 the middle, 1 to 3 at the corners.

struct Part {
  int depth;
  uint path;
};

const int kDeepest = 12;  // the weights below stay exact

// The middle comes first: it shows soonest that a whole is outside.
Part first_within(Part part) { return Part(part.depth + 1, part.path << 2); }

// What comes after a part and all within it; of depth 0 when that was the last.
Part next_after(Part part) {
  const uint path = part.path + 1;
  const int finished = min(findLSB(path) >> 1, part.depth);
  return Part(part.depth - finished, path >> (2 * finished));
}

// Barycentric weights, exact, of the part's three corners (columns) for those of the whole.
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
  const float unit = uintBitsToFloat(uint(127 - part.depth) << 23);  // 1 / whole; a division need not be exact
  return unit * mat3(whole - at.x - at.y, at, whole - second.x - second.y, second, whole - third.x - third.y, third);
}
