// SPDX-License-Identifier: Apache-2.0
// The threads of a scenario, run one at a time by one operating-system thread: stacks that hand control to
// each other (ucontext). A switch costs a few hundred nanoseconds and happens only where the schedule changes
// threads, so that hundreds of thousands of schedules fit into a second, and every run is repeatable to the
// instruction. A fiber may be left for good in the middle of a function (a run that has failed): its frames
// are then forgotten, not unwound, so scenario code keeps nothing on its stack that owns memory.
#pragma once
#include <ucontext.h>

#include <cstddef>
#include <memory>

#if defined(__SANITIZE_ADDRESS__)
#define ROWE_MODEL_ASAN 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define ROWE_MODEL_ASAN 1
#endif
#endif
#if defined(ROWE_MODEL_ASAN)
#include <sanitizer/asan_interface.h>
#include <sanitizer/common_interface_defs.h>
#endif

namespace rowe::model {

class fiber {
 public:
  // The thread that is running already: a fiber without a stack of its own.
  fiber() = default;
  fiber(const fiber&) = delete;
  fiber& operator=(const fiber&) = delete;

  // Makes the next switch to this fiber start at `entry`, which must not return. The stack is used again.
  void start_at(void (*entry)()) {
    if (!own_stack_) {
      own_stack_ = std::make_unique_for_overwrite<std::byte[]>(stack_bytes);
      getcontext(&context_); // a system call, so not for every run: makecontext is content with an old one
    }
    stack_ = own_stack_.get();
    stack_size_ = stack_bytes;
#if defined(ROWE_MODEL_ASAN)
    __asan_unpoison_memory_region(stack_, stack_size_); // frames of a run left for good
#endif
    entry_ = entry;
    context_.uc_stack.ss_sp = own_stack_.get();
    context_.uc_stack.ss_size = stack_bytes;
    context_.uc_link = nullptr;
    makecontext(&context_, &fiber::enter, 0);
  }

  // Goes on in `to`; returns when something switches back to `from`, which must be the running fiber. With
  // `for_good` nothing ever does.
  static void change(fiber& from, fiber& to, [[maybe_unused]] bool for_good = false) {
    left_ = &from;
    arriving_ = &to;
#if defined(ROWE_MODEL_ASAN)
    __sanitizer_start_switch_fiber(for_good ? nullptr : &from.shadow_, to.stack_, to.stack_size_);
#endif
    swapcontext(&from.context_, &to.context_);
    from.arrived();
  }

 private:
  static constexpr std::size_t stack_bytes = std::size_t{256} << 10;

  static void enter() {
    fiber& self = *arriving_;
    self.shadow_ = nullptr;
    self.arrived();
    self.entry_();
  }

  // The sanitizer tells the bounds of the stack that was left; that is how those of the first fiber are
  // learned.
  void arrived() {
#if defined(ROWE_MODEL_ASAN)
    __sanitizer_finish_switch_fiber(shadow_, &left_->stack_, &left_->stack_size_);
#endif
  }

  static inline fiber* left_ = nullptr;
  static inline fiber* arriving_ = nullptr;

  ucontext_t context_{};
  std::unique_ptr<std::byte[]> own_stack_;
  const void* stack_ = nullptr;
  std::size_t stack_size_ = 0;
  void* shadow_ = nullptr;
  void (*entry_)() = nullptr;
};

} // namespace rowe::model
