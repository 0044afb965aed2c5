// SPDX-License-Identifier: Apache-2.0
// In the page: asks ./chromium.js what to read, reads it, says what came of it, and begins anew.

import { read } from "./reader.js";

const say = (path, what) => fetch(path, { method: "POST", body: what });

// Between two looks at our clock that are as close as they come.
async function compare_clocks() {
  let best = { uncertain_ms: Infinity };
  for (let i = 0; i < 100; ++i) {
    const before = performance.now();
    const theirs = Number(await (await fetch("/clock")).text());
    const took = performance.now() - before;
    if (took / 2 < best.uncertain_ms) {
      best = { uncertain_ms: took / 2, clock_behind_ms: theirs - before - took / 2 };
    }
  }
  return best;
}

try {
  if (!crossOriginIsolated) throw new Error("the page's clock has steps of 100 us");
  const how = await (await fetch("/run")).json();
  const clocks = await compare_clocks();
  await say("/result", JSON.stringify({ ...clocks, ...(await read({ ...how, ...clocks })) }));
  location.reload();
} catch (fault) {
  say("/fault", String(fault));
}
