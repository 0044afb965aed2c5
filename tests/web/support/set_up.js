// SPDX-License-Identifier: Apache-2.0
// A robot as `rowe setup` makes it, served with TLS on this machine: its folder, tokens, and certificates for
// clients.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { free_port } from "./port.js";
import { program } from "./program.js";

const rowe = (...words) =>
  execFileSync(process.env.ROWE_BIN, words, { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });

export class set_up_robot {
  static async start() {
    const made = new set_up_robot();
    made.top = mkdtempSync(join(tmpdir(), "rowe-web-"));
    made.folder = join(made.top, "bot");
    const said = rowe("setup", "--name", "bot", "--keep-ca", "--dir", made.folder);
    const lines = [...said.matchAll(/^(observer|driver|supervisor|peer) +(\S+)$/gm)];
    made.tokens = Object.fromEntries(lines.map(([, role, token]) => [role, token]));
    made.port = await free_port();
    made.origin = `https://127.0.0.1:${made.port}`;
    made.url = `wss://127.0.0.1:${made.port}/`;
    return made;
  }

  // From now on clients are asked for a certificate, which they need not have.
  ask_for_certificates() {
    const settings = join(this.folder, "rowe.toml");
    const asks = readFileSync(settings, "utf8").replace("[tls]\n", '[tls]\nclient_ca = "ca.pem"\n');
    writeFileSync(settings, asks);
  }

  // `more` are further options of `rowe serve`.
  async serve(...more) {
    this.server = program.rowe("serve", "--demo", "--config", join(this.folder, "rowe.toml"),
      "--address", "127.0.0.1", "--port", String(this.port), ...more);
    await this.server.line(/rowe serves https:/);
  }

  // A new token; `how` as of `rowe token add`.
  token(name, role, ...how) {
    return /\S{40,}/.exec(rowe("token", "add", name, role, ...how, "--dir", this.folder))[0];
  }
  // The text of a new certificate and its key.
  certificate(name, role) {
    const file = join(this.top, `${name}.pem`);
    rowe("token", "add", name, role, "--certificate", file, "--dir", this.folder);
    return readFileSync(file, "utf8");
  }
  root() { return readFileSync(join(this.folder, "ca.pem"), "utf8"); }
  remove(name) { rowe("token", "remove", name, "--dir", this.folder); }

  end() {
    this.server?.child.kill("SIGKILL");
    rmSync(this.top, { recursive: true, force: true });
  }
}
