// SPDX-License-Identifier: Apache-2.0
#include "json/structs/encoder.hpp"

#include "json/structs/encoder_run.hpp"

namespace rowe::json {

encoder::encoder() noexcept = default;
encoder::encoder(encoder&&) noexcept = default;
encoder& encoder::operator=(encoder&&) noexcept = default;
encoder::~encoder() = default;

void encoder::encode(const void* object, writer& into) const noexcept {
  if (!is_text(into_)) return encode_binary(object, into);
  into.place_comma();
  into.comma_ = false; // the program's literals bring their own
  char* at = nullptr;
  if (!into.overflowed_) {
    const step* const first = program_.get();
    run r{*this, into};
    at = r.steps(first, first + step_count_, static_cast<const char*>(object), into.at_);
  }
  if (at != nullptr) {
    into.at_ = at;
  } else {
    into.overflow();
  }
  into.comma_ = true;
}

} // namespace rowe::json
