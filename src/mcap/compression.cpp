// SPDX-License-Identifier: Apache-2.0
#include "mcap/compression.hpp"

#include <algorithm>
#include <new>

#include <lz4frame.h>
#include <zstd.h>

namespace rowe::mcap {
namespace {

// Bytes that a decompressor is given room for at a time: a damaged length takes no more.
constexpr std::size_t step_bytes = std::size_t{1} << 20;

} // namespace

std::string_view name_of(compression which) noexcept {
  switch (which) {
  case compression::none: return "";
  case compression::lz4: return "lz4";
  case compression::zstd: return "zstd";
  }
  return "";
}

std::optional<compression> compression_named(std::string_view name) noexcept {
  for (const compression one : {compression::none, compression::lz4, compression::zstd})
    if (name == name_of(one)) return one;
  return {};
}

// ---- to compress

struct compressor::state {
  struct free_zstd {
    void operator()(ZSTD_CCtx* one) const noexcept { ZSTD_freeCCtx(one); }
  };
  std::unique_ptr<ZSTD_CCtx, free_zstd> zstd;
};

compressor::compressor(compression how) : how_{how}, state_{std::make_unique<state>()} {
  if (how != compression::zstd) return;
  state_->zstd.reset(ZSTD_createCCtx());
  if (!state_->zstd) throw std::bad_alloc{};
  ZSTD_CCtx_setParameter(state_->zstd.get(), ZSTD_c_compressionLevel, 1);
}
compressor::~compressor() = default;

void compressor::append(std::string& into, std::string_view plain) {
  const std::size_t at = into.size();
  if (how_ == compression::none) {
    into.append(plain);
  } else if (how_ == compression::zstd) {
    into.resize(at + ZSTD_compressBound(plain.size()));
    const std::size_t bytes =
        ZSTD_compress2(state_->zstd.get(), into.data() + at, into.size() - at, plain.data(), plain.size());
    if (ZSTD_isError(bytes) != 0) throw std::bad_alloc{}; // there is room: nothing else can fail
    into.resize(at + bytes);
  } else {
    LZ4F_preferences_t chosen{};
    chosen.frameInfo.blockSizeID = LZ4F_max1MB;
    chosen.frameInfo.contentSize = plain.size();
    into.resize(at + LZ4F_compressFrameBound(plain.size(), &chosen));
    const std::size_t bytes =
        LZ4F_compressFrame(into.data() + at, into.size() - at, plain.data(), plain.size(), &chosen);
    if (LZ4F_isError(bytes) != 0) throw std::bad_alloc{};
    into.resize(at + bytes);
  }
}

// ---- to decompress

struct decompressor::state {
  struct free_lz4 {
    void operator()(LZ4F_dctx* one) const noexcept { LZ4F_freeDecompressionContext(one); }
  };
  struct free_zstd {
    void operator()(ZSTD_DCtx* one) const noexcept { ZSTD_freeDCtx(one); }
  };
  std::unique_ptr<LZ4F_dctx, free_lz4> lz4;
  std::unique_ptr<ZSTD_DCtx, free_zstd> zstd;

  struct progress {
    std::size_t read = 0;
    std::size_t written = 0;
    bool ended = false; // of a frame; another one may follow
    bool whole = true;  // what it reads is not damaged
  };
  progress step(compression how, std::string_view from, char* to, std::size_t room) {
    if (how == compression::lz4) {
      std::size_t read = from.size();
      const std::size_t left = LZ4F_decompress(lz4.get(), to, &room, from.data(), &read, nullptr);
      return {read, room, left == 0, LZ4F_isError(left) == 0};
    }
    ZSTD_inBuffer in{from.data(), from.size(), 0};
    ZSTD_outBuffer out{to, room, 0};
    const std::size_t left = ZSTD_decompressStream(zstd.get(), &out, &in);
    return {in.pos, out.pos, left == 0, ZSTD_isError(left) == 0};
  }
};

decompressor::decompressor() : state_{std::make_unique<state>()} {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) throw std::bad_alloc{};
  state_->lz4.reset(made);
  state_->zstd.reset(ZSTD_createDCtx());
  if (!state_->zstd) throw std::bad_alloc{};
}
decompressor::~decompressor() = default;

bool decompressor::unpack(compression how, std::string_view packed, std::uint64_t plain_bytes,
                          std::string& into) {
  into.clear();
  if (how == compression::none) into.assign(packed);
  if (how == compression::none || packed.empty()) return into.size() == plain_bytes;
  LZ4F_resetDecompressionContext(state_->lz4.get());
  ZSTD_DCtx_reset(state_->zstd.get(), ZSTD_reset_session_only);
  for (;;) {
    const std::size_t at = into.size();
    const std::uint64_t room = std::min<std::uint64_t>(step_bytes, plain_bytes - at + 1); // more shows so
    into.resize(at + room);
    const state::progress done = state_->step(how, packed, into.data() + at, room);
    if (!done.whole || at + done.written > plain_bytes) return false;
    into.resize(at + done.written);
    packed.remove_prefix(done.read);
    if (packed.empty() && done.ended) return into.size() == plain_bytes;
    if (done.read == 0 && done.written == 0) return false; // it waits for what does not come
  }
}

} // namespace rowe::mcap
