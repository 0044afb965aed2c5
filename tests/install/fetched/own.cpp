// SPDX-License-Identifier: Apache-2.0
// With rowe's warnings as errors it would not compile.
static int rounded(double value) {
  int unused;
  return value;
}

int main() { return rounded(0.4); }
