// SPDX-License-Identifier: Apache-2.0
// Waiting for something to become true, with an end. The end is far: it says that something hangs, not that
// it is slow.

export const watchdog_ms = 60000;
const step_ms = 20;

// Resolves with the first truthy result of `probe` (which may be asynchronous); rejects with `what`
// otherwise.
export async function until(what, probe) {
  const end = Date.now() + watchdog_ms;
  for (;;) {
    const result = await probe();
    if (result) return result;
    if (Date.now() > end) throw new Error(`not within ${watchdog_ms} ms: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, step_ms));
  }
}
