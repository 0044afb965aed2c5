// SPDX-License-Identifier: Apache-2.0
// A robot that `rowe setup` made and `rowe serve` serves by https: where it is, the tokens of its roles, its
// folder.
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { free_port } from "./port.js";
import { until } from "./watchdog.js";

export const rowe = (...words) =>
  execFileSync(process.env.ROWE_BIN, words, { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });

// `more` are further options of `rowe serve`.
export async function start_robot(...more) {
  const parent = mkdtempSync(join(tmpdir(), "rowe-web-"));
  const folder = join(parent, "bot");
  const made = rowe("setup", "--name", "bot", "--dir", folder);
  const lines = [...made.matchAll(/^(observer|driver|supervisor|peer) +(\S+)$/gm)];
  const tokens = Object.fromEntries(lines.map(([, role, token]) => [role, token]));
  const port = await free_port();
  const origin = `https://127.0.0.1:${port}`;
  let said = "";
  const how = ["--demo", "--config", join(folder, "rowe.toml"), "--address", "127.0.0.1",
    "--port", String(port), ...more];
  const server = spawn(process.env.ROWE_BIN, ["serve", ...how], { stdio: ["ignore", "pipe", "pipe"] });
  for (const stream of [server.stdout, server.stderr]) stream.on("data", (words) => (said += words));
  await until("the robot serves", async () => {
    if (server.exitCode !== null) throw new Error(said);
    return said.includes("rowe serves https://");
  });
  const end = () => {
    server.kill("SIGKILL");
    rmSync(parent, { recursive: true, force: true });
  };
  return { origin, tokens, folder, end };
}
