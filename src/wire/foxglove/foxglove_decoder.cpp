// SPDX-License-Identifier: Apache-2.0
#include "wire/foxglove/foxglove_codec.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "wire/codec/members.hpp"
#include "wire/codec/own_names.hpp"
#include "wire/foxglove/foxglove.hpp"
#include "wire/text/text_out.hpp"
#include "json/reading/reader.hpp"

namespace rowe::wire {
namespace {

using namespace foxglove_words;

constexpr std::size_t operation_bytes_shown = 48;
constexpr std::size_t element_bytes_shown = 64;

decoded refuse(diagnostic& why, std::string_view text, decoded as = decoded::refused) noexcept {
  why = {.code = "bad_request", .text = text};
  return as;
}

// What a list in a message means.
enum class list : std::uint8_t {
  requests, // each element is a request of its own
  whole,    // the list is a part of the request
  none,     // there is no list
};

struct operation {
  std::string_view name;
  std::string_view list_name;
  list means;
  verb what;
  std::string_view element; // what one must be
};
constexpr std::array operations{
    operation{"subscribe", "subscriptions", list::requests, verb::subscribe,
              "have an `id` and a `channelId`, numbers below 4294967295"},
    operation{"unsubscribe", "subscriptionIds", list::requests, verb::unsubscribe,
              "be a number below 4294967295"},
    operation{"advertise", "channels", list::requests, verb::advertise,
              "have an `id` (a number below 4294967295), a `topic` that is no longer than a name may be, and "
              "perhaps a `schemaName`, likewise"},
    operation{"unadvertise", "channelIds", list::requests, verb::unadvertise, "be a number below 4294967295"},
    operation{"getParameters", "parameterNames", list::whole, verb::get_parameters, "be a text"},
    operation{"setParameters", "parameters", list::whole, verb::set_parameters,
              "have a `name`, a text, and no `type` \"byte_array\", which no parameter here has"},
    operation{"subscribeParameterUpdates", "parameterNames", list::whole, verb::subscribe_parameters,
              "be a text"},
    operation{"unsubscribeParameterUpdates", "parameterNames", list::whole, verb::unsubscribe_parameters,
              "be a text"},
    operation{"subscribeConnectionGraph", {}, list::none, verb::subscribe_graph, {}},
    operation{"unsubscribeConnectionGraph", {}, list::none, verb::unsubscribe_graph, {}},
};

const operation* find_operation(const json::value& op) noexcept {
  const auto* const found = std::find_if(operations.begin(), operations.end(),
                                         [&](const operation& one) { return json::text_is(op, one.name); });
  return found == operations.end() ? nullptr : found;
}

decoded refuse_operation(const json::value& op, std::span<char> buffer, diagnostic& why) noexcept {
  text_out text{buffer};
  text.add("no such operation: ").add_shortened(op.raw, operation_bytes_shown);
  return refuse(why, text.add("; serverInfo says what this server is capable of").text());
}

decoded refuse_list(const operation& of, std::string_view what, std::span<char> buffer,
                    diagnostic& why) noexcept {
  text_out text{buffer};
  return refuse(why, text.add(of.name).add(": `").add(of.list_name).add("` ").add(what).text());
}

decoded refuse_element(const operation& of, std::uint32_t index, const json::value& is,
                       std::span<char> buffer, diagnostic& why) noexcept {
  text_out text{buffer};
  text.add(of.name).add(": element ").add(index).add(" of `").add(of.list_name).add("` must ");
  text.add(of.element).add("; it is ").add_shortened(is.raw, element_bytes_shown);
  return refuse(why, text.text());
}

decoded refuse_length(const operation& of, std::uint32_t most, std::span<char> buffer,
                      diagnostic& why) noexcept {
  text_out text{buffer};
  text.add(of.name).add(": far too many parameters in one message: more than ").add(most);
  return refuse(why, text.text());
}

bool take_number(const std::optional<json::value>& from, std::uint32_t& into) noexcept {
  const auto number = from ? json::to_unsigned(*from) : std::nullopt;
  if (!number || *number >= no_number) return false;
  into = static_cast<std::uint32_t>(*number);
  return true;
}

bool take_name(const json::value& from, std::span<char> scratch, std::size_t bytes_max,
               std::string_view& into) noexcept {
  const auto name = json::to_string(from, scratch);
  if (!name || name->size() > bytes_max || has_control_characters(*name)) return false;
  into = *name;
  return true;
}

bool take_channel(const json::value& element, const decode_buffers& buffers, request& into) noexcept {
  if (!take_number(json::find(element.raw, "id"), into.tag)) return false;
  const std::size_t most = buffers.limits.name_bytes_max;
  const auto topic = json::find(element.raw, "topic");
  if (!topic || !take_name(*topic, buffers.scratch.first(most), most, into.topic) || into.topic.empty())
    return false;
  const auto type = json::find(element.raw, "schemaName");
  return !type || take_name(*type, buffers.scratch.subspan(most, most), most, into.type);
}

bool take(const json::value& element, const decode_buffers& buffers, request& into) noexcept {
  switch (into.what) {
  case verb::unsubscribe: into.by_number = true; return take_number(element, into.tag);
  case verb::unadvertise:
    into.by_number = into.channel_is_peers = true;
    return take_number(element, into.channel);
  case verb::subscribe:
    into.by_number = true;
    return element.type == json::kind::object && take_number(json::find(element.raw, "id"), into.tag) &&
           take_number(json::find(element.raw, "channelId"), into.channel);
  default: return element.type == json::kind::object && take_channel(element, buffers, into);
  }
}

decoded take_one_of(const operation& of, std::string_view text, json::array_walk elements,
                    const decode_buffers& buffers, request& into, diagnostic& why) noexcept {
  json::value element;
  if (!elements.next(element))
    return refuse_list(of, "is empty: it must have at least one element", buffers.diagnostic, why);
  const std::size_t next = elements.place_in(text);
  if (json::value more; elements.next(more))
    into.next = {static_cast<std::uint32_t>(next), buffers.from.index + 1,
                 static_cast<std::uint8_t>(&of - operations.data())};
  if (!take(element, buffers, into)) {
    into.by_number = false;
    return refuse_element(of, buffers.from.index, element, buffers.diagnostic, why);
  }
  if (into.what != verb::advertise) return decoded::request;
  const auto encoding = json::find(element.raw, "encoding");
  if (encoding && json::text_is(*encoding, json_encoding)) return decoded::request;
  text_out wrong{buffers.diagnostic};
  wrong.add(R"(advertise: the `encoding` of a channel must be "json", as in supportedEncodings; it is )");
  return refuse(why, wrong.add_shortened(encoding ? encoding->raw : "missing", element_bytes_shown).text());
}

bool is_parameter(const json::value& element) noexcept {
  if (element.type != json::kind::object) return false;
  const auto name = json::find(element.raw, "name");
  const auto type = json::find(element.raw, "type");
  return name && name->type == json::kind::string && !(type && json::text_is(*type, "byte_array"));
}

bool is_id(const json::value& id, const decode_buffers& buffers) noexcept {
  return id.type == json::kind::string && id.raw.size() <= buffers.limits.id_bytes_max;
}

decoded take_whole(const operation& of, const json::document& text, const json::value& all,
                   const decode_buffers& buffers, request& into, diagnostic& why) noexcept {
  json::array_walk elements{all.raw};
  std::uint32_t index = 0;
  for (json::value one; elements.next(one); ++index) {
    if (index == buffers.limits.parameters_max) return refuse_length(of, index, buffers.diagnostic, why);
    const bool fits = of.what == verb::set_parameters ? is_parameter(one) : one.type == json::kind::string;
    if (!fits) return refuse_element(of, index, one, buffers.diagnostic, why);
  }
  const auto id = json::find(text, "id");
  if (id && !is_id(*id, buffers)) {
    text_out wrong{buffers.diagnostic};
    wrong.add(of.name).add(": `id` must be a text of at most ");
    wrong.add(buffers.limits.id_bytes_max - 2).add(" bytes; it is ");
    return refuse(why, wrong.add_shortened(id->raw, element_bytes_shown).text());
  }
  into.body_raw = all.raw;
  return decoded::request;
}

} // namespace

decoded foxglove_decoder::decode(const json::document& text, const decode_buffers& buffers, request& into,
                                 diagnostic& why) const noexcept {
  into.codec = id_;
  if (buffers.from) { // the rest of a list
    const operation& of = operations[buffers.from.means];
    into.what = of.what;
    into.verb_text = of.name;
    return take_one_of(of, text.text, json::array_walk{text.text, buffers.from.at}, buffers, into, why);
  }
  if (!json::is_object(text.text)) {
    why = {.code = "not_an_object", .text = "the message must be a JSON object"};
    return decoded::malformed;
  }
  const auto op = json::find(text, "op");
  if (!op || op->type != json::kind::string)
    return refuse(why, "the message must have a member `op`, a string");
  const operation* const known = find_operation(*op);
  if (known == nullptr) {
    into.what = verb::unsupported;
    return refuse_operation(*op, buffers.diagnostic, why);
  }
  into.what = known->what;
  into.verb_text = known->name;
  if (known->means == list::none) return decoded::request;
  // The answer carries it, whatever else is wrong.
  if (const auto id = json::find(text, "id"); known->means == list::whole && id && is_id(*id, buffers))
    into.id_raw = id->raw;
  const auto all = json::find(text, known->list_name);
  if (!all || all->type != json::kind::array)
    return refuse_list(*known, all ? "must be a list" : "is missing: it must be a list", buffers.diagnostic,
                       why);
  if (known->means == list::whole) return take_whole(*known, text, *all, buffers, into, why);
  return take_one_of(*known, text.text, json::array_walk{all->raw}, buffers, into, why);
}

decoded foxglove_decoder::decode_binary(std::span<const std::byte> message, const decode_buffers& buffers,
                                        request& into, diagnostic& why) const noexcept {
  const std::string_view bytes{reinterpret_cast<const char*>(message.data()), message.size()};
  into.codec = id_;
  if (bytes.starts_with(client_message)) {
    if (bytes.size() <= channel_head_bytes)
      return refuse(why, "a published message must have a channel's number and a body", decoded::malformed);
    into.what = verb::publish;
    into.by_number = into.channel_is_peers = true;
    into.channel = number_at(bytes.substr(1));
    into.body_raw = bytes.substr(channel_head_bytes);
    return decoded::request;
  }
  if (!bytes.starts_with(service_request)) {
    text_out text{buffers.diagnostic};
    text.add("a binary message must begin with 1 (published) or 2 (a call); it ");
    if (bytes.empty()) return refuse(why, text.add("is empty").text(), decoded::malformed);
    text.add("begins with ").add(static_cast<unsigned char>(bytes[0]));
    return refuse(why, text.text(), decoded::malformed);
  }
  into.what = verb::call;
  constexpr std::string_view no_numbers = "a call must have the numbers of its service and of itself";
  if (bytes.size() < 1 + 4) return refuse(why, no_numbers, decoded::malformed);
  into.by_number = true;
  into.service_number = number_at(bytes.substr(1)); // so a stop is one, whatever is missing behind
  if (bytes.size() < 1 + call_id_bytes) return refuse(why, no_numbers, decoded::malformed);
  into.id_raw = bytes.substr(1, call_id_bytes);
  if (bytes.size() < call_head_bytes) return refuse(why, "a call must name its encoding", decoded::malformed);
  const std::size_t named = number_at(bytes.substr(1 + call_id_bytes));
  if (named > bytes.size() - call_head_bytes)
    return refuse(why, "the name of the call's encoding is longer than the message", decoded::malformed);
  const std::string_view encoding = bytes.substr(call_head_bytes, named);
  into.body_raw = bytes.substr(call_head_bytes + named);
  if (encoding != json_encoding)
    return refuse(why, "the encoding of a call must be \"json\", as in supportedEncodings");
  return decoded::request;
}

std::size_t foxglove_decoder::body_begins(std::byte first) const noexcept {
  switch (static_cast<char>(first)) {
  case client_message: return channel_head_bytes;
  case service_request: return call_head_bytes + json_encoding.size(); // another encoding is refused anyway
  default: return 0;
  }
}

bool foxglove_decoder::may_be_stop(opcode what, std::string_view begins) const noexcept {
  return what == opcode::binary && begins.starts_with(service_request) &&
         number_at(begins.substr(1)) == stop_service_number;
}

} // namespace rowe::wire
