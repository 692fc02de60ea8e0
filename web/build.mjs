// Builds the bundle that the package ships, or the tests.
//
//   node build.mjs                    the bundle, into the package
//   node build.mjs --into FOLDER      the bundle, somewhere else
//   node build.mjs --tests            the tests, into build/tests
//
// The same sources and the same esbuild give the same bytes.
import { readdirSync, rmSync } from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { build } from "esbuild";

const HERE = path.dirname(fileURLToPath(import.meta.url));
const PACKAGE = path.join(HERE, "../src/driftwalk/page/static");

const { values } = parseArgs({
  options: { tests: { type: "boolean", default: false }, into: { type: "string" } },
});
const common = { absWorkingDir: HERE, bundle: true, target: "es2022", logLevel: "warning" };

async function buildBundle(folder) {
  await build({
    ...common,
    entryPoints: { driftwalk: "src/main.ts" },
    outdir: folder,
    format: "iife",
    minify: true,
    legalComments: "none",
  });
  // The worker that runs a tank without a server; its tests call it by this name.
  await build({
    ...common,
    entryPoints: { playground: "src/local/playground.ts" },
    outdir: folder,
    format: "iife",
    globalName: "driftwalkPlayground",
    minify: true,
    legalComments: "none",
  });
}

async function buildTests(folder) {
  rmSync(folder, { recursive: true, force: true });
  const tests = readdirSync(path.join(HERE, "tests")).filter((name) => name.endsWith(".test.ts"));
  await build({
    ...common,
    entryPoints: tests.map((name) => `tests/${name}`),
    outdir: folder,
    outExtension: { ".js": ".mjs" },
    format: "esm",
    platform: "node",
  });
}

if (values.tests) await buildTests(path.join(HERE, "build/tests"));
else await buildBundle(values.into === undefined ? PACKAGE : path.resolve(values.into));
