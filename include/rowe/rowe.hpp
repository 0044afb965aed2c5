// SPDX-License-Identifier: Apache-2.0
// rowe: a real-time loop that speaks to the Web. Everything a program needs; each header stands alone too.
#pragma once
#include <rowe/endpoint.hpp>
#include <rowe/event.hpp>
#include <rowe/options.hpp>
#include <rowe/publisher.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/periodic.hpp>
#include <rowe/schema.hpp>
#include <rowe/subscriber.hpp>
