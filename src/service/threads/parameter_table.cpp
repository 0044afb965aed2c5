// SPDX-License-Identifier: Apache-2.0
#include "service/threads/parameter_table.hpp"

#include <algorithm>
#include <memory>

#include "wire/codec/own_names.hpp"

namespace rowe::service {

using phase = detail::parameter_cell::phase;

parameter_table::cell* parameter_table::find(std::string_view name) noexcept {
  const auto found = std::find_if(cells_.begin(), cells_.end(), [name](const cell& one) {
    // relaxed: set-up alone makes cells active; one that is closed meanwhile may still be found
    return one.state.load(std::memory_order_relaxed) == phase::active &&
           wire::without_slash(one.name()) == wire::without_slash(name);
  });
  return found == cells_.end() ? nullptr : &*found;
}

parameter_table::cell* parameter_table::open(const detail::parameter_request& asked,
                                             int wake_descriptor) noexcept {
  cell* const found = find_free(asked.name);
  if (found == nullptr) return nullptr;
  build(*found, asked, news_, wake_descriptor);
  // release: pairs with the acquire in parameters::take()
  found->state.store(phase::active, std::memory_order_release);
  announce();
  return found;
}

// The cell that had this name last, or else the next free one in turn: as long as its name stands there,
// peers that read slowly can learn that the parameter is gone.
parameter_table::cell* parameter_table::find_free(std::string_view name) noexcept {
  cell* longest = nullptr;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    cell& one = cells_[(next_ + i) % cells_.size()];
    // acquire: pairs with the release in parameters::take()
    if (one.state.load(std::memory_order_acquire) != phase::free) continue;
    if (one.opened != 0 && wire::without_slash(one.name()) == wire::without_slash(name)) return &one;
    if (longest == nullptr) longest = &one;
  }
  if (longest != nullptr) next_ = static_cast<std::size_t>(longest - cells_.data()) + 1;
  return longest;
}

void parameter_table::build(cell& made, const detail::parameter_request& asked,
                            rt::std_atomics::variable<bool>& news, int wake_descriptor) noexcept {
  // Nobody looks at the windows of a free cell. They begin anew, and so do their ends.
  for (detail::parameter_cell::window* const one : {&made.to_program, &made.from_program}) {
    std::destroy_at(one);
    std::construct_at(one);
  }
  ++made.opened;
  std::size_t bytes = 0;
  if (!asked.name.starts_with('/')) made.name_text[bytes++] = '/';
  bytes += asked.name.copy(made.name_text.data() + bytes, made.name_text.size() - bytes);
  made.name_bytes = static_cast<std::uint8_t>(bytes);
  made.what = asked.what;
  made.service_in = made.to_program.take_writer();
  made.user_in = made.to_program.take_reader();
  made.user_out = made.from_program.take_writer();
  made.service_out = made.from_program.take_reader();
  made.user_out->write(asked.first); // as if the program had set it
  made.news = &news;
  made.wake_descriptor = wake_descriptor;
}

bool parameter_table::any_closing() const noexcept {
  return std::any_of(cells_.begin(), cells_.end(), [](const cell& one) {
    // acquire: pairs with the release in parameters::take()
    return one.state.load(std::memory_order_acquire) == phase::closing;
  });
}

void parameter_table::close(cell& of) noexcept {
  // release: pairs with the acquire in look(); the handle does not touch the cell any more
  of.state.store(phase::closing, std::memory_order_release);
  announce();
}

void parameter_table::end() noexcept {
  for (cell& one : cells_) one.closed.store(true, std::memory_order_relaxed); // relaxed: advice
}

void parameter_table::end_in_child() noexcept {
  end();
  for (cell& one : cells_) {
    one.forked = true;
    one.wake_descriptor = -1;
  }
}

} // namespace rowe::service
