// SPDX-License-Identifier: Apache-2.0
// A value for a thread, through a window; threads are in the archive.
#include <cstdio>

#include <rowe/rt/thread.hpp>
#include <rowe/rt/window.hpp>

int main() {
  rowe::rt::window<int> window;
  window.take_writer()->write(1);
  int seen = 0;
  rowe::rt::thread reader{{.name = "reader"}, [&] { (void)window.take_reader()->read(seen); }};
  reader.join();
  std::printf("read by reader: %d\n", seen);
  return 0;
}
