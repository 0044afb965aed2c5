// SPDX-License-Identifier: Apache-2.0
// The slow application, the same in Node and in a page: it spends `spend_us` on each message of telemetry. It
// stands alone, for it is sent to the page as text.

// Resolves with what `wanted` urgent messages said that were handed over `warm_ms` after the begin or later,
// and when the application was called for them (`at`) and for each message of telemetry; in milliseconds of
// CLOCK_MONOTONIC, by which this program's own clock is `clock_behind_ms` behind.
export function read(how, WebSocket = globalThis.WebSocket) {
  const { url, spend_us, throttle_rate, wanted, warm_ms, clock_behind_ms } = how;
  const now = () => performance.now() + clock_behind_ms;
  const socket = new WebSocket(url);
  const telemetry = [];
  const urgent = [];
  return new Promise((resolve, reject) => {
    let begin;
    socket.onopen = () => {
      begin = now();
      for (const more of [{ topic: "/telemetry", throttle_rate }, { topic: "/urgent" }]) {
        socket.send(JSON.stringify({ op: "subscribe", ...more }));
      }
    };
    socket.onclose = ({ code, reason }) => reject(new Error(`${url} is closed: ${code} ${reason}`));
    socket.onmessage = ({ data }) => {
      const at = now();
      const said = data.match(/"t":(\d+),"kernels":(\d+)/);
      if (!said) {
        telemetry.push(at);
        while (now() < at + spend_us / 1000) continue;
      } else if (said[1] / 1e6 >= begin + warm_ms) {
        urgent.push({ stamp: said[1], handed_over: said[1] / 1e6, kernels: Number(said[2]), at });
        if (urgent.length < wanted) return;
        socket.onmessage = socket.onclose = null;
        socket.terminate ? socket.terminate() : socket.close();
        resolve({ urgent, telemetry });
      }
    };
  });
}
