// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include <rowe/endpoint.hpp>
#include <rowe/rowe.h>

#include "capi/outside.hpp"
#include "capi/struct_table.hpp"

// C's name of an endpoint. Behind the pointer, so that C may call it const everywhere, as the paper does.
struct rowe_endpoint {
  std::unique_ptr<rowe::capi::struct_descriptions> structs; // outlive the service thread, which reads them
  std::unique_ptr<rowe::endpoint> inside;
};
