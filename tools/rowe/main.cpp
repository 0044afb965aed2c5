// SPDX-License-Identifier: Apache-2.0
// rowe VERB [arguments]: see verbs/verb_list.hpp.
#include "output.hpp"
#include "verbs/verb_list.hpp"

int main(int count, char** words) { return rowe::tools::run_program(count, words, rowe::tools::run_verb); }
