// SPDX-License-Identifier: Apache-2.0
#include "page_files.hpp"

#include <cstddef>

// The file's name behind plot_, with _ for its dots, as tools/rowe/plot/page_files.cmake has it.
#define ROWE_PLOT_FILES(X)                                                                                   \
  X(plot_colours_css, colours)                                                                               \
  X(plot_plot_css, style)                                                                                    \
  X(plot_plot_js, script)                                                                                    \
  X(plot_dygraph_min_js, dygraphs)                                                                           \
  X(plot_dygraph_min_css, dygraphs_style)                                                                    \
  X(plot_copyright, dygraphs_licence)

extern "C" {
#define ROWE_PLOT_SYMBOLS(id, function) extern const char rowe_asset_##id[], rowe_asset_##id##_end[];
ROWE_PLOT_FILES(ROWE_PLOT_SYMBOLS)
#undef ROWE_PLOT_SYMBOLS
}

namespace rowe::tools::page_files {

#define ROWE_PLOT_FUNCTION(id, function)                                                                     \
  std::string_view function() noexcept {                                                                     \
    return {rowe_asset_##id, static_cast<std::size_t>(rowe_asset_##id##_end - rowe_asset_##id)};             \
  }
ROWE_PLOT_FILES(ROWE_PLOT_FUNCTION)
#undef ROWE_PLOT_FUNCTION
#undef ROWE_PLOT_FILES

} // namespace rowe::tools::page_files
