// SPDX-License-Identifier: Apache-2.0
// Files that somebody drops onto the page, or picks: what shows recordings is loaded then.

import { element } from "./dom.js";
import { text } from "./text.js";

const holds_files = ({ dataTransfer }) => dataTransfer?.types.includes("Files") ?? false;

// Calls open(file).
export function take_files(open) {
  const pick = element("pick");
  const open_it = element("open_recording");
  open_it.onclick = () => pick.click();
  open_it.title = text.open_recording;
  pick.onchange = () => {
    const [file] = pick.files;
    if (file) open(file);
    pick.value = "";  // so that the same one can be picked again
  };
  const over = (is_over) => document.body.toggleAttribute("data-drop", is_over);
  addEventListener("dragover", (event) => {
    if (!holds_files(event)) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = "copy";
    over(true);
  });
  addEventListener("dragleave", ({ relatedTarget }) => relatedTarget ?? over(false));
  addEventListener("drop", (event) => {
    if (!holds_files(event)) return;
    event.preventDefault();  // else the browser leaves the page, and STOP with it
    over(false);
    const [file] = event.dataTransfer.files;
    if (file) open(file);
  });
}
