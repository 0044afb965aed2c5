// SPDX-License-Identifier: Apache-2.0
// A variable of the environment, for tests of what reads them.
#pragma once
#include <cstdlib>

// As long as the object lives.
class variable {
 public:
  variable(const char* name, const char* value) : name_{name} { ::setenv(name, value, 1); }
  variable(const variable&) = delete;
  variable& operator=(const variable&) = delete;
  ~variable() { ::unsetenv(name_); }

 private:
  const char* name_;
};
