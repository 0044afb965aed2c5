// SPDX-License-Identifier: Apache-2.0
// Who this page is to the robot: a token, where the robot wants one. It comes in the fragment of the page's
// address, which browsers send to nobody, or is typed in. It is kept for this tab alone, until that is
// closed.

const kept_as = "rowe.token";
const prefix = "#token=";
// A browser cannot set headers of a WebSocket, so the token is an offered subprotocol. The robot chooses the
// other one.
const other = "rowe.v1";
const subprotocol = "rowe.token.";
const possible = /^[A-Za-z0-9._~-]{1,128}$/;  // what a robot takes, and a WebSocket can offer

export class token {
  // `storage` as sessionStorage, `place` as location, `trail` as history.
  constructor(storage, place, trail) {
    Object.assign(this, { storage, place, trail });
    this.value = "";
    this.set(storage.getItem(kept_as) ?? "");
    this.take_fragment();
  }

  // Takes the token out of the address, where it would be shown and kept. True if there was one.
  take_fragment() {
    if (!this.place.hash.startsWith(prefix)) return false;
    this.set(this.place.hash.slice(prefix.length));
    this.trail.replaceState(null, "", this.place.pathname + this.place.search);
    return true;
  }

  // False, and there is none: no robot has such a token.
  set(value) {
    const words = value.trim();
    if (!possible.test(words)) return this.forget();
    this.value = words;
    this.storage.setItem(kept_as, words);
    return true;
  }

  // The robot does not know it, or does not any more: to show it again would look like guessing.
  forget() {
    this.value = "";
    this.storage.removeItem(kept_as);
    return false;
  }

  // For a WebSocket. One that needs no token offers nothing.
  get subprotocols() { return this.value ? [other, subprotocol + this.value] : []; }
  // For a request.
  get headers() { return this.value ? { Authorization: `Bearer ${this.value}` } : {}; }
}

const unknown = [401, 429];  // the latter to who has shown wrong tokens again and again

// Whether the robot knows who asks. A refused WebSocket does not tell a page why; this resource does. Null if
// the robot cannot be reached.
export async function is_known(who, ask = fetch) {
  try {
    const answer = await ask("/metrics", { method: "HEAD", headers: who.headers, cache: "no-store" });
    return !unknown.includes(answer.status);
  } catch {
    return null;
  }
}
