// SPDX-License-Identifier: Apache-2.0
#include "recorders.hpp"

#include <utility>

#include "text/amounts.hpp"

namespace rowe::tools {

bool recorders::begin(endpoint& on, const configuration& of, const console& to) {
  for (const record_options& chosen : recordings_of(of)) {
    std::string why;
    auto made = on.record(chosen, &why);
    if (!made) {
      to.error("cannot record: ", why.empty() ? made.error().message() : printable(why));
      return false;
    }
    const bool is_black_box = chosen.file.black_box.before > rt::duration{0};
    for (const std::string& path : made->unended())
      to.note(printable(path), " was not ended by its program; `rowe record --repair` does it");
    if (is_black_box)
      to.note("a black box keeps the last ", seconds_text(chosen.file.black_box.before), " for ",
              printable(chosen.file.path));
    else
      to.note("recording into ", printable(made->figures().path));
    all_.push_back({std::move(*made), is_black_box});
  }
  return true;
}

void recorders::look(const console& to) {
  for (one& each : all_) {
    std::string fault = each.of.figures().fault;
    if (fault == each.fault) continue;
    if (!fault.empty())
      to.error(printable(fault));
    else
      to.note("recording again");
    each.fault = std::move(fault);
  }
}

void recorders::end(bool black_boxes_only, const console& to) {
  for (one& each : all_) {
    if (!each.of || (black_boxes_only && !each.is_black_box)) continue;
    std::string why;
    if (!each.of.close(&why)) {
      all_whole_ = false;
      if (why != each.fault) to.error(printable(why));
    }
    const recording_figures done = each.of.figures();
    if (done.files != 0)
      to.note(each.is_black_box ? "black box: " : "recorded: ", counted(done.messages, "message"), ", ",
              bytes_text(done.bytes), " in ", counted(done.files, "file"),
              done.lost == 0 ? "" : joined(", lost ", done.lost));
    each.of = {};
  }
}

} // namespace rowe::tools
