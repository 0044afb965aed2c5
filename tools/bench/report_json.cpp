// SPDX-License-Identifier: Apache-2.0
// The result as one JSON object on one line: stable keys, with their unit.
#include <array>
#include <charconv>

#include "../rowe/console.hpp"
#include "../rowe/text/json_values.hpp"
#include "report.hpp"

namespace rowe::tools::bench {
namespace {

// Builds an object; values are JSON already, or are made so.
class object {
 public:
  object& raw(std::string_view name, std::string_view value) {
    text_ += joined(text_.size() > 1 ? "," : "", json_string_of(name), ":", value);
    return *this;
  }
  object& text(std::string_view name, std::string_view value) { return raw(name, json_string_of(value)); }
  object& number(std::string_view name, std::uint64_t value) { return raw(name, std::to_string(value)); }
  object& number(std::string_view name, double value) {
    std::array<char, 64> buffer;
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
    return raw(name, {buffer.data(), static_cast<std::size_t>(end - buffer.data())});
  }
  object& time(std::string_view name, rt::duration value) {
    return raw(joined(name, "_ns"), std::to_string(value.count()));
  }
  object& boolean(std::string_view name, bool value) { return raw(name, value ? "true" : "false"); }
  std::string end() { return text_ + "}"; }

 private:
  std::string text_ = "{";
};

template <class List, class ToJson>
std::string array_of(const List& list, ToJson&& json_of_one) {
  std::string text = "[";
  for (const auto& one : list) text += joined(text.size() > 1 ? "," : "", json_of_one(one));
  return text + "]";
}

std::string machine_json(const machine& m) {
  return object{}
      .text("line", m.line())
      .text("host", m.host)
      .text("kernel", m.kernel)
      .text("preemption", m.real_time)
      .boolean("real_time", m.is_real_time())
      .text("processor", m.processor)
      .text("hypervisor", m.hypervisor)
      .text("governor", m.governor)
      .text("isolated_cpus", m.isolated)
      .text("clock", m.clock)
      .text("load", m.load)
      .raw("warnings", array_of(m.warnings, [](const std::string& w) { return json_string_of(w); }))
      .end();
}

void add_percentiles(object& to, const rt::histogram& h) {
  to.number("samples", h.count()).time("min", h.min());
  for (const double percent : shown_percentiles) to.time(percentile_key(percent), h.percentile(percent));
  to.time("max", h.max());
}

std::string sample_json(const sample& one) {
  return object{}.time("at", one.at).time("value", one.value).end();
}

// [lowest, highest, count] of each bucket that holds anything.
std::string buckets_json(const rt::histogram& h) {
  std::string text = "[";
  for (std::size_t i = 0; i < h.counters().size(); ++i) {
    const std::uint64_t count = h.counters()[i].get();
    if (count == 0) continue;
    text += joined(text.size() > 1 ? "," : "", "[", rt::histogram::lowest_of(i, h.precision_bits()), ",",
                   rt::histogram::highest_of(i, h.precision_bits()), ",", count, "]");
  }
  return text + "]";
}

void add_samples(object& to, const report& r) {
  const recording& s = *r.samples;
  add_percentiles(to, s.times());
  to.number("intended", r.counts.intended)
      .number("finished", r.counts.finished)
      .number("failed", r.counts.failed)
      .number("unfinished", r.counts.unfinished);
  if (s.bound() != rt::for_ever) to.time("over_limit", s.bound()).number("over", s.over_count());
  to.raw("over_samples", array_of(s.over(), sample_json))
      .raw("worst_samples", array_of(s.worst(), sample_json));
  to.raw("buckets_ns", buckets_json(s.times()));
}

std::string usage_json(const thread_usage& u) {
  object o;
  o.number("page_faults", u.page_faults)
      .number("own_context_switches", u.waits)
      .number("forced_context_switches", u.preemptions);
  if (!u.allocations) return o.raw("allocations", "null").raw("locks", "null").end();
  return o.number("allocations", *u.allocations).number("locks", *u.locks).end();
}

} // namespace

std::string json_of(const report& r) {
  object o;
  o.text("bench", r.mode).raw("machine", machine_json(r.where));
  o.raw("peer", r.peer.empty() ? "null" : json_string_of(r.peer));
  o.text("measured", r.measured);
  object how;
  for (const setting& s : r.settings) how.text(s.name, s.value);
  o.raw("settings", how.end()).time("ran", r.ran);
  if (r.samples != nullptr) add_samples(o, r);
  object parts;
  for (const part& p : r.parts) {
    object one;
    one.text("name", p.name);
    add_percentiles(one, *p.times);
    parts.raw(p.key, one.end());
  }
  o.raw("parts", parts.end());
  object figures;
  for (const figure& f : r.figures) figures.number(f.key, f.value);
  o.raw("figures", figures.end());
  o.raw("measuring_thread", r.usage ? usage_json(*r.usage) : "null");
  o.raw("bounds", array_of(r.bounds, [](const bound& b) {
          return object{}
              .text("name", b.name)
              .time("limit", b.limit)
              .time("found", b.found)
              .boolean("held", b.held())
              .end();
        }));
  o.raw("problem", r.problem.empty() ? "null" : json_string_of(r.problem));
  o.number("exit_code", static_cast<std::uint64_t>(verdict_of(r)));
  return o.end() + "\n";
}

} // namespace rowe::tools::bench
