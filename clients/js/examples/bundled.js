// SPDX-License-Identifier: Apache-2.0
// With a bundler: a button for any page that stops the robot and says what became of it.
//
//     npx esbuild bundled.js --bundle --minify --global-name=stop_button --outfile=stop_button.js
//
// and in the page: <script src="stop_button.js"></script>
//                  <script>stop_button.add(document.body, "ws://robot:8080")</script>

import { connect } from "rowe";

export function add(parent, url) {
  const robot = connect(url);
  const button = parent.appendChild(document.createElement("button"));
  const says = parent.appendChild(document.createElement("span"));
  button.textContent = "STOP";
  button.onclick = async () => {
    says.textContent = "asked";
    try {
      const { took_ms } = await robot.stop.press({ source: "button" });
      says.textContent = `acknowledged in ${took_ms.toFixed(1)} ms`;
    } catch ({ message }) {
      says.textContent = `NOT ACKNOWLEDGED, asking on: ${message}`;
    }
  };
  return robot;
}
