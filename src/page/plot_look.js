// SPDX-License-Identifier: Apache-2.0
// What plots look like: on the page, and in the HTML files of `rowe plot`. Their colours are in colours.css,
// and what dygraphs, which draws them, has no option for is in plot_look.css.

// Of the lines, in their order: variables of colours.css.
export const colours = ["--accent", "--two", "--three", "--four"];

// The legend of dygraphs writes style attributes, which a content policy may forbid. Names and values stand
// above each plot instead.
export function without_legend(Dygraph) {
  Dygraph.PLUGINS = Dygraph.PLUGINS.filter((each) => each !== Dygraph.Plugins.Legend);
  return Dygraph;
}

// Options for dygraphs; `style` is the computed one of where the plot is.
export function look_of(style) {
  const colour = (name) => style.getPropertyValue(name).trim();
  return {
    strokeWidth: 2, axisLabelFontSize: 12, axisLineColor: colour("--line"), gridLineColor: colour("--grid"),
  };
}
