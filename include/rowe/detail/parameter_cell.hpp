// SPDX-License-Identifier: Apache-2.0
// What a parameter's handle and the service thread share: its description, and a window each way. Set-up
// writes a free cell and then makes it active; the handle marks it as closing; only the service thread frees
// it, when it does not look at it any more.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include <rowe/rt/atomics.hpp>
#include <rowe/rt/waker.hpp>
#include <rowe/rt/window.hpp>
#include <rowe/schema.hpp>

namespace rowe::detail {

class endpoint_state;

inline constexpr std::size_t parameter_text_bytes_max = 124;

enum class parameter_kind : std::uint8_t { boolean, integer, natural, real, text, choice };

// A value of any of these types. Numbers stand in the first eight bytes: a bool as a natural number, and the
// value of an enum as an integer.
struct parameter_value {
  std::array<char, parameter_text_bytes_max> bytes{};
  std::uint32_t count = 0;

  template <class T>
  static parameter_value of_number(T number) noexcept {
    static_assert(sizeof(T) == 8);
    parameter_value made;
    std::memcpy(made.bytes.data(), &number, sizeof number);
    made.count = sizeof number;
    return made;
  }
  template <class T>
  T number() const noexcept {
    static_assert(sizeof(T) == 8);
    T read;
    std::memcpy(&read, bytes.data(), sizeof read);
    return read;
  }
  // The text has at most parameter_text_bytes_max bytes.
  static parameter_value of_text(std::string_view text) noexcept {
    parameter_value made;
    made.count = static_cast<std::uint32_t>(text.copy(made.bytes.data(), made.bytes.size()));
    return made;
  }
  std::string_view text() const noexcept { return {bytes.data(), count}; }
  friend bool operator==(const parameter_value& a, const parameter_value& b) noexcept {
    return a.text() == b.text();
  }
};
static_assert(sizeof(parameter_value) == 128);

// What a parameter may be.
struct parameter_description {
  parameter_kind kind = parameter_kind::boolean;
  bool single = false;                             // real: a float
  std::uint32_t text_bytes_max = 0;                // text
  parameter_value least{};                         // numbers
  parameter_value most{};                          // numbers
  std::span<const enumerator_description> names{}; // choice
};

// What a handle asks of set-up.
struct parameter_request {
  std::string_view name;
  parameter_description what;
  parameter_value first;
};

struct parameter_cell {
  using window = rt::window<parameter_value>;
  enum class phase : std::uint8_t { free, active, closing };
  static constexpr std::size_t name_bytes_max = 255;

  std::string_view name() const noexcept { return {name_text.data(), name_bytes}; }

  // Written at set-up, while the cell is free.
  std::array<char, name_bytes_max> name_text{};
  std::uint8_t name_bytes = 0;
  parameter_description what;
  window to_program;   // from the service thread
  window from_program; // from the handle
  window::writer* service_in = nullptr;
  window::reader* service_out = nullptr;
  window::writer* user_out = nullptr;
  window::reader* user_in = nullptr;
  rt::std_atomics::variable<bool>* news = nullptr; // of all cells: a handle has set something
  int wake_descriptor = -1;                        // under idle::wake

  // Free to active by set-up, active to closing by the handle, closing to free by the service thread.
  rt::std_atomics::variable<phase> state{phase::free};
  rt::std_atomics::variable<bool> closed{false}; // the endpoint is
  bool forked = false;                           // closed, since this process is a child of the endpoint's
  std::uint32_t opened = 0;                      // how often; by set-up
};

// A handle's thread: hands a value to the service thread. Wait-free; under idle::wake one call of the kernel.
inline void set_parameter(parameter_cell& cell, const parameter_value& value) noexcept {
  cell.user_out->write(value);
  cell.news->store(true, std::memory_order_release); // release: pairs with the exchange in take_news()
  if (cell.wake_descriptor >= 0) [[unlikely]]
    rt::eventfd_signal{cell.wake_descriptor}.raise();
}

void close_parameter(endpoint_state& of, parameter_cell& cell) noexcept;

// A cell, and the endpoint that it lies in.
class parameter_handle {
 public:
  parameter_handle() noexcept = default;
  parameter_handle(std::shared_ptr<endpoint_state> of, parameter_cell& owned) noexcept
      : state_{std::move(of)}, cell_{&owned} {}
  parameter_handle(parameter_handle&& from) noexcept
      : state_{std::move(from.state_)}, cell_{std::exchange(from.cell_, nullptr)} {}
  parameter_handle& operator=(parameter_handle&& from) noexcept {
    if (this != &from) {
      reset();
      state_ = std::move(from.state_);
      cell_ = std::exchange(from.cell_, nullptr);
    }
    return *this;
  }
  ~parameter_handle() { reset(); }

  explicit operator bool() const noexcept { return cell_ != nullptr; }
  parameter_cell* operator->() const noexcept { return cell_; }
  parameter_cell& operator*() const noexcept { return *cell_; }

 private:
  void reset() noexcept {
    if (state_) close_parameter(*state_, *cell_); // without a state, in a test, the harness owns the cell
    cell_ = nullptr;
    state_.reset();
  }

  std::shared_ptr<endpoint_state> state_;
  parameter_cell* cell_ = nullptr;
};

} // namespace rowe::detail
