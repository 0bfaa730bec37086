// The page in Chromium with software WebGPU.

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { chromium } from "playwright-core";

export const { size, scenes } = JSON.parse(readFileSync(new URL("scenes.json", import.meta.url)));
/** With it, the picture has the size of the scenes. */
export const viewport = { width: size[0] + 300, height: size[1] };
const PATIENCE = 120_000;

export const repository = new URL("../../", import.meta.url);
export const reference = (name) => readFileSync(join(process.env.REFERENCE, name));

const launchWith = (options, ...args) =>
  chromium.launch({
    executablePath: process.env.CHROMIUM,
    args: ["--no-sandbox", "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", ...args],
    ...options,
  });

export const launch = () => launchWith({});

/** With a window on an X server: everything is composited on SwiftShader, canvases of WebGPU included. */
export const launchOnScreen = (display) =>
  launchWith({ headless: false, env: { ...process.env, DISPLAY: display } }, "--enable-features=Vulkan",
    "--use-vulkan=swiftshader", "--use-angle=vulkan", "--disable-vulkan-surface", "--ignore-gpu-blocklist");

/** A page that has loaded, and what it complains about. `query`: how pictures are shown. */
export async function open(browser, hash = "", options = {}, script, query = "?present=copy") {
  const context = await browser.newContext({ viewport, ...options });
  const page = await context.newPage();
  if (script) await page.addInitScript(script);
  page.setDefaultTimeout(PATIENCE);
  const complaints = [];
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  // Presenting loses the device in Chromium without a screen.
  await page.goto(`${process.env.PAGE}${query}${hash && "#"}${hash}`);
  return { page, complaints, context };
}

/** Follows a link as the address bar would, but before this returns. */
export const goTo = (page, link) =>
  page.evaluate((link) => {
    history.replaceState(null, "", `#${link}`);
    dispatchEvent(new HashChangeEvent("hashchange"));
  }, link);

const state = (page) => page.locator("#state").textContent();

/** Waits until what was done before is in the finished picture. */
export async function finished(page) {
  // The page acts in the next animation frame.
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  await page.waitForFunction(() => ["finished", "stopped", "no GPU"].includes(document.getElementById("state").textContent));
  if ((await state(page)) !== "finished") throw new Error(await page.locator("#message").innerText());
}

/** Waits until a volume of this name is loaded and its picture finished. */
export async function loaded(page, name) {
  await page.waitForFunction((start) => document.getElementById("name").textContent.startsWith(start), name);
  await finished(page);
}

/** The finished picture: bytes of colour, depth and status. */
export async function capture(page) {
  await finished(page);
  const texts = await page.evaluate(async () => {
    const text = (array) => {
      const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
      let result = "";
      for (let i = 0; i < bytes.length; i += 0x8000) result += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
      return btoa(result);
    };
    const picture = await window.page.capture();
    const shown = document.getElementById("canvas").getContext("2d").getImageData(0, 0, picture.width(), picture.height());
    return { color: text(picture.color()), depth: text(picture.depth()), status: text(picture.status()), shown: text(shown.data) };
  });
  return Object.fromEntries(Object.entries(texts).map(([kind, text]) => [kind, Buffer.from(text, "base64")]));
}

export const rows = (page) =>
  page.evaluate(() => Object.fromEntries([...document.querySelectorAll("#rows dt")].map((name) => [name.textContent, name.nextSibling.textContent])));

/** Drops a file on the page as a mouse would. */
export async function drop(page, name, bytes) {
  const transfer = await page.evaluateHandle(([name, text]) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    return transfer;
  }, [name, bytes.toString("base64")]);
  await page.dispatchEvent("#canvas", "dragover", { dataTransfer: transfer });
  await page.dispatchEvent("#canvas", "drop", { dataTransfer: transfer });
}
