// SPDX-License-Identifier: Apache-2.0
// How the page writes numbers, times and lengths. Pure functions.

const minus = "\u2212";
export const absent = "\u2013";

// `value` with `digits` decimals and a minus sign as wide as a digit; a dash for what is not a number.
export function fixed(value, digits) {
  if (!Number.isFinite(value)) return absent;
  const shown = Math.abs(value).toFixed(digits);
  return value < 0 && Number(shown) !== 0 ? minus + shown : shown;
}

// A length in metres, within seven characters up to 10 000 km.
export function metres(value) {
  const size = Math.abs(value);
  return fixed(value, size < 100 ? 3 : size < 1000 ? 2 : size < 10000 ? 1 : 0);
}

// A count with thin spaces between its thousands.
export function count(value) {
  if (!Number.isFinite(value)) return absent;
  return String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

// Something per second: one decimal below 10 000, thousands parted above; a plain 0 for none.
export function rate(value) {
  if (!Number.isFinite(value)) return absent;
  if (value >= 9999.95) return count(value);
  return value > 0 ? fixed(value, 1) : "0";
}

// How long a cycle took, from microseconds, in milliseconds: three decimals below ten, two digits above.
export const period_ms = (us) => fixed(us / 1000, us < 9999.5 ? 3 : us < 99950 ? 1 : 0);

// How long something short took: "0.34 ms", "4.2 ms", "120 ms", "1.2 s".
export function short(ms) {
  return ms < 99.95 ? `${ms.toFixed(ms < 0.995 ? 2 : 1)}\u00a0ms` : age(ms);
}

// An address without its port, which changes with each connection; anything else as it is.
export const address = (source) => String(source).replace(/^(\d+(?:\.\d+){3}|\[[^\]]*\]):\d+$/, "$1");

// The calendar's time of day: "07:39:05".
export const clock = (at) => new Date(at).toTimeString().slice(0, 8);

// Its day: "2026-11-30".
export const day = (at) => new Date(at).toLocaleDateString("sv");

// How old something is: "18 ms", "2.4 s", "3 min".
export function age(ms) {
  if (ms < 1000) return `${Math.round(ms)} ms`;
  if (ms < 99950) return `${(ms / 1000).toFixed(1)} s`;
  return duration(ms / 1000);
}

// How long something has lasted: "12 s", "3 min 5 s", "4 h 10 min", "3 d 4 h".
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return absent;
  const units = [["d", 86400], ["h", 3600], ["min", 60], ["s", 1]];
  let rest = Math.floor(seconds);
  const parts = [];
  for (const [unit, size] of units) {
    const whole = Math.floor(rest / size);
    rest -= whole * size;
    if (whole > 0 || parts.length > 0) parts.push(`${whole} ${unit}`);
    if (parts.length === 2) break;
  }
  return parts.join(" ") || "0 s";
}

// Seconds to come: tenths below one, and never none.
export const until = (ms) => Math.max(0.1, ms / 1000).toFixed(ms < 950 ? 1 : 0);
