// SPDX-License-Identifier: Apache-2.0
// Numbers that are read off numbers as they come: the rate of a count, and a peak that is held.

const window_seconds = 2;  // over which a count becomes a rate, and a peak is held: long enough to be read
const samples_max = 64;

// Turns a count that only grows into a rate over the last `window_seconds`. Memory is fixed.
export class rate_meter {
  constructor() {
    this.samples = [];
  }

  // `at` in seconds. Returns the rate, or NaN until two samples are there. A count that fell was started
  // anew, and so is one that was not heard of for longer than the window.
  rate(at, value) {
    const { samples } = this;
    const last = samples.at(-1);
    const gap = last && at - last.at >= window_seconds;
    if (last && (value < last.value || at < last.at || gap)) samples.length = 0;
    if (!last || at > last.at || samples.length === 0) samples.push({ at, value });
    while (samples.length > 2 && at - samples[1].at >= window_seconds) samples.shift();
    if (samples.length > samples_max) samples.splice(1, 1);
    const [oldest] = samples;
    return at > oldest.at ? (value - oldest.value) / (at - oldest.at) : NaN;
  }
}

// Holds the largest value of the last `window_seconds`. Memory is fixed.
export class peak_meter {
  constructor() {
    this.samples = [];
  }

  peak(at, value) {
    let { samples } = this;
    if (samples.length > 0 && at < samples.at(-1).at) samples = [];
    // What is both older and smaller than the newest can never be the largest again.
    samples = samples.filter((each) => at - each.at < window_seconds && each.value > value);
    samples.push({ at, value });
    this.samples = samples.slice(-samples_max);
    return this.samples[0].value;
  }
}
