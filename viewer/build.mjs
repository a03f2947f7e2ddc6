// Bundles the viewer into the Python package, with three.js's licence beside it.
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build, version } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ?? join(here, "../toponav/worlds/viewer");
const sha256 = (data) => createHash("sha256").update(data).digest("hex");

mkdirSync(out, { recursive: true });
await build({
  entryPoints: [join(here, "src/viewer.js")],
  outfile: join(out, "viewer.js"),
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "ascii",
  legalComments: "none",
});
writeFileSync(join(out, "page.html"), readFileSync(join(here, "src/page.html")));
const three = join(here, "node_modules/three");
writeFileSync(join(out, "LICENSE.three"), readFileSync(join(three, "LICENSE")));
const sources = ["build.mjs", "package-lock.json", "src/page.html", "src/viewer.js"];
const manifest = {
  esbuild: version,
  three: JSON.parse(readFileSync(join(three, "package.json"))).version,
  sources: Object.fromEntries(sources.map((name) => [name, sha256(readFileSync(join(here, name)))])),
  built: Object.fromEntries(
    ["LICENSE.three", "page.html", "viewer.js"].map((name) => [name, sha256(readFileSync(join(out, name)))]),
  ),
};
writeFileSync(join(out, "manifest.json"), `${JSON.stringify(manifest, null, 2)}\n`);
