// SPDX-License-Identifier: Apache-2.0
// rowe: a real-time loop that speaks to the Web. Includes all that a program needs; each header can also be
// included alone.
#pragma once
#include <rowe/caller.hpp>
#include <rowe/connection.hpp>
#include <rowe/emergency_stop.hpp>
#include <rowe/endpoint.hpp>
#include <rowe/event.hpp>
#include <rowe/json_error.hpp>
#include <rowe/json_value.hpp>
#include <rowe/lane.hpp>
#include <rowe/message.hpp>
#include <rowe/message_view.hpp>
#include <rowe/options.hpp>
#include <rowe/publisher.hpp>
#include <rowe/received.hpp>
#include <rowe/responder.hpp>
#include <rowe/result.hpp>
#include <rowe/rt/periodic.hpp>
#include <rowe/schema.hpp>
#include <rowe/settings.hpp>
#include <rowe/subscriber.hpp>
#include <rowe/types.hpp>
