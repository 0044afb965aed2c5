// SPDX-License-Identifier: Apache-2.0
// The page that every endpoint serves: the files of this folder, embedded when the library is built. The core
// hands its HTTP requests here; what comes back points to constant memory, so it may be written at any later
// time.
//
// Everything is served in two forms, gzip for those who accept it and identity for the others, each with its
// own strong ETag, from which the transport answers 304. All answers are `no-cache`: a browser asks again
// each time, so a robot that was updated is never looked at through the files of its former version.
#pragma once
#include "service/base/transport.hpp"

namespace rowe::page {

// The answer to a GET of `request.path`: a file of the page, or 404 with a sentence.
// Service thread, or any other: a pure function. Never waits, never allocates.
service::http_answer answer(const service::http_request& request) noexcept;
// The same without the page: one can log in all the same.
service::http_answer login_alone(const service::http_request& request) noexcept;

} // namespace rowe::page
