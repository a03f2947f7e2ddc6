// Bundles the editor's page into the Python package, and notes what it was built from.
import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build, version } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ?? join(here, "../toponav/maps/editor/static");
const sha256 = (data) => createHash("sha256").update(data).digest("hex");

mkdirSync(out, { recursive: true });
await build({
  entryPoints: { editor: join(here, "src/main.ts") },
  outdir: out,
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "utf8",
  legalComments: "none",
});
await build({
  entryPoints: { editor: join(here, "src/style/editor.css") },
  outdir: out,
  bundle: true,
  minify: true,
  target: "es2022",
  charset: "utf8",
});
for (const name of ["index.html", "icon.svg"]) {
  writeFileSync(join(out, name), readFileSync(join(here, "src", name)));
}

const sources = readdirSync(join(here, "src"), { recursive: true, withFileTypes: true })
  .filter((entry) => entry.isFile())
  .map((entry) => join(entry.parentPath, entry.name).slice(here.length + 1).replaceAll("\\", "/"));
const listed = (folder, names) =>
  Object.fromEntries(names.sort().map((name) => [name, sha256(readFileSync(join(folder, name)))]));
const manifest = {
  esbuild: version,
  sources: listed(here, [...sources, "build.mjs", "package-lock.json"]),
  bundle: listed(out, ["editor.css", "editor.js", "icon.svg", "index.html"]),
};
writeFileSync(join(out, "manifest.json"), `${JSON.stringify(manifest, null, 2)}\n`);
