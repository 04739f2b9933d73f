// The extension of `dsl editor vscode` in VS Code itself, driven as a person would: pictures to be looked at.
//
//     NODE_PATH=.../node_modules node tests/benchmarks/vscode_host.js SERVER_MAIN FOLDER SCENE PICTURES [CHROMIUM]
//
// SERVER_MAIN is `lib/vscode/out/server-main.js` of the npm package `code-server`, into which the extension was put by
// `node SERVER_MAIN --install-extension softmark-VERSION.vsix`. FOLDER has SCENE, and in it a line
// with `poisson` and two models, so that "run MODEL" stands over one. `playwright-core` is of npm. Where `dsl`
// is not found, ~/.vscode-server-oss/data/Machine/settings.json has {"softmark.command": ".../dsl"}.
//
// On 2026-11-23, with VS Code 1.100 of code-server 4.100.3 and Chromium: installed, activated, coloured; the message of
// a wrong field with its remedy under PROBLEMS; meaning on pointing; completion while typing; "run MODEL" runs in a
// task, and the measured numbers stand beside `metric` and `expect` when it ends.
"use strict";
const { spawn } = require("child_process");
const path = require("path");
const { chromium } = require("playwright-core");

const [, , main, folder, scene, pictures, browser = "/usr/bin/chromium"] = process.argv;
const PORT = 8123;
const words = [
  "--host",
  "127.0.0.1",
  "--port",
  String(PORT),
  "--without-connection-token",
  "--accept-server-license-terms",
];

async function look(page) {
  const show = async (name, wait) => {
    await page.waitForTimeout(wait);
    await page.screenshot({ path: path.join(pictures, `${name}.png`) });
  };
  await page.goto(`http://127.0.0.1:${PORT}/?folder=${folder}`);
  await page.waitForSelector(".monaco-workbench", { timeout: 60000 });
  await page
    .locator("text=Yes, I trust the authors")
    .click({ timeout: 20000 })
    .catch(() => {});
  await page.waitForTimeout(2000);
  await page.dblclick(`.explorer-folders-view >> text=${scene}`);
  await show("opened", 10000);
  await page.locator(".view-line", { hasText: "poisson" }).first().locator("text=poisson").first().hover();
  await show("pointed", 2500);
  await page.locator(".view-line").last().click();
  await page.keyboard.press("Control+End");
  await page.keyboard.type("\nload push = pre");
  await show("typed", 3000);
  await page.keyboard.press("Escape");
  for (let n = 0; n < 9; n++) await page.keyboard.press("Control+z");
  await page.waitForTimeout(1500);
  await page.keyboard.press("Control+Shift+M");
  await show("messages", 2500);
  await page.locator(".codelens-decoration >> text=/^run ./").first().click();
  await show("run", 12000);
}

async function all() {
  const server = spawn("node", [main, ...words], { stdio: "ignore" });
  await new Promise((done) => setTimeout(done, 5000));
  const chrome = await chromium.launch({ executablePath: browser, args: ["--no-sandbox"] });
  try {
    await look(await chrome.newPage({ viewport: { width: 1300, height: 850 } }));
  } finally {
    await chrome.close();
    server.kill();
  }
}
all();
