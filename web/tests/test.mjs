// Tests of the page in Chromium: `cargo xtask web --test`.

import assert from "node:assert/strict";
import { mkdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { capture, drop, finished, goTo, launch, launchOnScreen, loaded, open, reference, repository, rows, scenes, size } from "./browser.mjs";
import { changedShare, differences } from "./compare.mjs";

const output = process.env.OUTPUT;
mkdirSync(output, { recursive: true });
const data = (name) => readFileSync(new URL(`volume-io/tests/data/${name}`, repository));

let browser;
let page;
let complaints;

before(async () => {
  browser = await launch();
  ({ page, complaints } = await open(browser));
  await loaded(page, "brain.zfp");
});
after(() => browser?.close());

const set = (id, value) =>
  page.locator(id).evaluate((input, value) => {
    input.value = value;
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }, value);
const message = () => page.locator("#message p").innerText();

test("the comparison fails where it should", () => {
  const picture = () => ({ color: Buffer.from([9, 8, 7, 255]), depth: Buffer.from([0, 0, 128, 63]), status: Buffer.from([1]) });
  assert.deepEqual(differences(picture(), picture(), 1), []);
  for (const [kind, at, by, count] of [["color", 0, 1, 0], ["color", 0, 2, 1], ["depth", 0, 1, 1], ["status", 0, 1, 1]]) {
    const other = picture();
    other[kind][at] += by;
    assert.equal(differences(other, picture(), 1).length, count, `${kind} by ${by}`);
  }
  assert.equal(differences({ ...picture(), depth: Buffer.alloc(0) }, picture(), 1).length, 1);
  assert.equal(changedShare(Buffer.from([1, 2]), Buffer.from([1, 3])), 0.5);
});

test("pictures are those of the native renderer", async () => {
  for (const { name, link } of scenes) {
    await goTo(page, link);
    const found = await capture(page);
    const expected = Object.fromEntries(["color", "depth", "status"].map((kind) => [kind, reference(`${name}.${kind}`)]));
    assert.equal(expected.status.length, size[0] * size[1]);
    assert.ok(expected.status.filter((status) => status === 1).length > 10_000, "the surface is in the picture");
    assert.deepEqual(differences(found, expected, 1), [], name);
    assert.deepEqual(found.shown, found.color, `${name}: the canvas shows the finished picture`);
  }
});

test("slider, mouse, wheel and keyboard change the picture, and Home brings it back", async () => {
  await goTo(page, "iso=58");
  await page.locator("#reset").click();
  const first = await capture(page);
  const changes = {
    slider: () => set("#isovalue", 75),
    number: () => set("#isovalue-number", 58),
    drag: async () => {
      await page.mouse.move(200, 120);
      await page.mouse.down();
      await page.mouse.move(260, 140, { steps: 4 });
      await page.mouse.up();
    },
    "shift-drag": async () => {
      await page.keyboard.down("Shift");
      await page.mouse.down();
      await page.mouse.move(230, 120, { steps: 3 });
      await page.mouse.up();
      await page.keyboard.up("Shift");
    },
    wheel: () => page.mouse.wheel(0, -200),
    arrow: () => page.locator("#canvas").press("ArrowLeft"),
    plus: () => page.locator("#canvas").press("+"),
  };
  let last = first;
  for (const [name, change] of Object.entries(changes)) {
    await change();
    const found = await capture(page);
    const share = changedShare(found.color, last.color);
    assert.ok(share > 0.02, `${name} changes ${share} of the picture`);
    last = found;
  }
  await page.locator("#canvas").press("Home");
  assert.deepEqual(differences(await capture(page), first, 0), []);
});

test("while the camera moves, the canvas is never blank", async () => {
  await page.locator("#reset").click();
  await finished(page);
  const dark = await page.evaluate(async () => {
    const canvas = document.getElementById("canvas");
    const shares = [];
    for (let i = 0; i < 40; i++) {
      canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
      await new Promise((done) => requestAnimationFrame(done));
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let surface = 0;
      for (let p = 0; p < data.length; p += 4) surface += data[p + 2] < 190 ? 1 : 0;
      shares.push(surface / (data.length / 4));
    }
    return shares;
  });
  assert.ok(Math.min(...dark) > 0.6 * Math.max(...dark), `shares of surface pixels: ${dark}`);
  await finished(page);
});

test("settings keep the picture or change it as they say", async () => {
  await page.locator("#reset").click();
  const first = await capture(page);
  await page.selectOption("#strategy", "sorted");
  assert.deepEqual(differences(await capture(page), first, 0), [], "block sorted");
  assert.equal((await rows(page)).strategy, "block sorted");
  await set("#budget", 5);
  assert.deepEqual(differences(await capture(page), first, 0), [], "32 MiB");
  await page.selectOption("#strategy", "ahead");
  await set("#scale", 0.5);
  const half = await capture(page);
  assert.equal(half.status.length, first.status.length / 4);
  await set("#scale", 1);
  await set("#threshold", 0.5);
  await set("#budget", 8);
  await page.locator("#canvas").press("ArrowRight");
  await finished(page);
  const { passes } = await page.evaluate(() => window.page.measurements());
  assert.ok(passes.at(-1) >= 0.5, `complete enough: ${passes}`);
  await set("#threshold", 1);
  await page.locator("#canvas").press("Home");
  assert.deepEqual(differences(await capture(page), first, 0), [], "everything back");
});

test("a link restores volume, isovalue and view", async () => {
  await page.locator("#canvas").press("ArrowUp");
  await page.mouse.wheel(0, -100);
  await set("#isovalue", 66.5);
  const expected = await capture(page);
  await page.locator("#share").click();
  const link = new URL(page.url());
  assert.match(link.hash, /^#iso=66.5&view=/);
  const other = await open(browser, link.hash.slice(1));
  await loaded(other.page, "brain.zfp");
  assert.equal(await other.page.locator("#isovalue-number").inputValue(), "66.5");
  assert.deepEqual(differences(await capture(other.page), expected, 0), []);
  assert.deepEqual(other.complaints, []);
  // Another volume, by its address.
  const address = new URL("brain.zfp?again", process.env.PAGE).href;
  await goTo(page, `volume=${encodeURIComponent(address)}&iso=70`);
  await page.waitForFunction(() => document.getElementById("isovalue-number").value === "70");
  await finished(page);
  await page.locator("#share").click();
  assert.ok(page.url().includes(`#volume=${address}&iso=70`), page.url());
  await other.context.close();
});

test("the read-outs say what the picture took", async () => {
  await finished(page);
  const found = await rows(page);
  for (const [name, expected] of Object.entries({
    complete: /^100 %$/, passes: /^[1-9]\d*$/, time: /\d (ms|s)$/, "last pass": /ms (GPU|CPU)$/, "blocks decoded": /^[1-9]/,
    volume: /^193 × 229 × 193$/, picture: new RegExp(`^${size.join(" × ")}$`), "GPU memory": /B$/, "compressed volume": /MB$/,
    "decoded blocks": /MB$/, rays: /B$/, pictures: /MB$/, "value ranges": /kB$/,
  })) assert.match(found[name] ?? "", expected, name);
  assert.equal(await page.locator("#meter").evaluate((meter) => meter.value), 1);
});

test("the picture is saved as PNG", async () => {
  const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#save").click()]);
  const bytes = readFileSync(await download.path());
  assert.equal(bytes.subarray(1, 4).toString(), "PNG");
  assert.deepEqual([bytes.readUInt32BE(16), bytes.readUInt32BE(20)], size);
  assert.ok((await pixels(page, bytes)).equals((await capture(page)).color), "it is the finished picture");
});

test("files of every kind load by drop and by choice", async () => {
  const files = [
    ["npy/float32.npy", "NumPy"], ["int16.nii", "NIfTI"], ["scaled.nii.gz", "NIfTI"],
    ["raw/ramp_7x5x6_uint16.raw", "raw"], ["accuracy.zfp", "zfp"], ["nrrd/gzip.nrrd", "NRRD"], ["vti/binary_zlib_32.vti", "VTK"],
  ];
  for (const [path, kind] of files) {
    const name = path.split("/").pop();
    await drop(page, name, data(path));
    await loaded(page, name);
    assert.ok((await page.locator("#name").innerText()).startsWith(`${name}: ${kind}`));
    assert.equal(await page.locator("#message").isVisible(), false);
    assert.equal(await page.locator("#share").isDisabled(), true, "a local file has no address");
  }
  assert.equal((await rows(page)).volume, "7 × 5 × 6");
  await page.locator("#file").setInputFiles({ name: "rate.zfp", mimeType: "", buffer: data("rate_4.zfp") });
  await loaded(page, "rate.zfp");
  assert.ok((await capture(page)).status.includes(1), "a surface");
});

test("a broken file says what is wrong and leaves the volume", async () => {
  const before = await capture(page);
  const broken = [
    ["noise.bin", Buffer.from("nothing that is a volume at all, whatever"), /unknown kind of file/],
    ["ramp.raw", data("raw/ramp_7x5x6_uint8.raw"), /NAME_XxYxZ_TYPE/],
    ["short.nii", data("int16.nii").subarray(0, 400), /end too early|too short/],
    ["nan.npy", data("npy/nan.npy"), /NaN/],
    ["empty.zfp", Buffer.alloc(0), /empty|header/],
  ];
  for (const [name, bytes, expected] of broken) {
    await drop(page, name, bytes);
    await page.locator("#message").waitFor({ state: "visible" });
    assert.match(await message(), expected, name);
    assert.equal(await page.locator("#loading").isVisible(), false);
    await page.locator("#message button").click();
  }
  assert.deepEqual(differences(await capture(page), before, 0), []);
});

const brain = readFileSync(new URL("volumes/data/icbm152-2009c-t1-brain.zfp", repository));

test("a broken fixed-rate file is refused at any stage and leaves volume, picture and settings", async () => {
  await goTo(page, "iso=60&view=-40,20,1.5,0,0,0");
  await loaded(page, "brain.zfp");
  const before = await capture(page);
  const [hash, texts] = [() => page.evaluate(() => document.getElementById("isovalue-number").value), await rows(page)];
  const isovalue = await hash();
  const unsafe = Buffer.from(brain);
  unsafe.fill(0xff, 700_000, 701_000);
  const broken = [
    ["cut.zfp", brain.subarray(0, 1_000_000), /too early|too short|bytes/],
    ["header.zfp", brain.subarray(0, 24), /too early|too short|bytes/],
    ["unsafe.zfp", unsafe, /block/],
  ];
  for (const [name, bytes, expected] of broken) {
    await drop(page, name, bytes);
    await page.locator("#message").waitFor({ state: "visible" });
    assert.match(await message(), expected, name);
    assert.equal(await page.locator("#loading").isVisible(), false);
    assert.equal(await page.locator("#name").innerText(), "brain.zfp");
    assert.deepEqual(differences(await capture(page), before, 0), [], name);
    assert.equal(await hash(), isovalue);
    assert.equal((await rows(page)).volume, texts.volume);
    await page.locator("#message button").click();
  }
  await page.locator("#canvas").press("ArrowLeft");
  assert.ok(changedShare((await capture(page)).color, before.color) > 0.02, "the old volume still turns");
});

test("an address that cannot be reached says so and leaves the volume", async () => {
  const before = await capture(page);
  for (const [url, expected] of [["http://localhost:9/volume.zfp", /cannot be reached/], [new URL("missing.zfp", process.env.PAGE).href, /404/]]) {
    await page.locator("#url").fill(url);
    await page.locator("#url").press("Enter");
    await page.locator("#message").waitFor({ state: "visible" });
    assert.match(await message(), expected);
    assert.deepEqual(differences(await capture(page), before, 0), []);
    await page.locator("#message button").click();
  }
  // The browser itself tells the console of both.
  const told = complaints.splice(0);
  assert.ok(told.length === 2 && told.every((text) => text.startsWith("Failed to load resource")), told.join());
});

test("a refused setting says so, keeps the picture and goes back", async () => {
  const before = await capture(page);
  const settings = ["budget", "strategy", "infill", "scale", "threshold"];
  const values = () => page.evaluate((ids) => ids.map((id) => document.getElementById(id).value), settings);
  const old = await values();
  await page.locator("#budget").evaluate((input) => (input.min = 0));
  await set("#budget", 0);
  await page.locator("#message").waitFor({ state: "visible" });
  assert.match(await message(), /not possible: the scene needs at least \d+ bytes of GPU memory, the budget is 1048576/);
  assert.deepEqual(await values(), old);
  assert.deepEqual(differences(await capture(page), before, 0), []);
  await page.locator("#message button").click();
  // What was refused is forgotten: another volume opens.
  await page.locator("#budget").evaluate((input) => (input.min = 4));
  await drop(page, "rate.zfp", data("rate_4.zfp"));
  await loaded(page, "rate.zfp");
  assert.equal(await page.locator("#message").isVisible(), false);
  await goTo(page, "iso=58");
  await loaded(page, "brain.zfp");
});

/** Pixels of the canvas in the colour of unfinished ones, and of filled ones in the read-outs, frame by frame. */
const watch = (page, act) =>
  page.evaluate(async (act) => {
    const canvas = document.getElementById("canvas");
    const filled = () => {
      const name = [...document.querySelectorAll("#rows dt")].find((name) => name.textContent === "filled pixels");
      return Number(name.nextSibling.textContent.replace(/\D/g, ""));
    };
    const seen = { holes: 0, filled: 0 };
    const look = async () => {
      await new Promise((done) => requestAnimationFrame(done));
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let holes = 0;
      for (let p = 0; p < data.length; p += 4) holes += data[p] === 204 && data[p + 1] === 212 && data[p + 2] === 222;
      seen.holes = Math.max(seen.holes, holes);
      seen.filled = Math.max(seen.filled, filled());
    };
    for (let i = 0; i < act.steps; i++) {
      canvas.dispatchEvent(new KeyboardEvent("keydown", { key: act.key }));
      for (let frame = 0; frame < 4; frame++) await look();
    }
    for (let frame = 0; frame < 3 || document.getElementById("state").textContent !== "finished"; frame++) await look();
    // The last copy of the picture may come a frame later.
    await look();
    return seen;
  }, act);

test("unfinished pixels are filled, and finished pictures stay as they are", async () => {
  await goTo(page, "iso=58&view=-100.5,35.25,1.7,0.1,-0.05,0.2");
  await page.selectOption("#infill", "off");
  await set("#budget", Math.log2(24));
  const first = await capture(page);
  assert.equal((await rows(page))["in-fill"], "off");
  for (const infill of ["classical", "network"]) {
    await page.selectOption("#infill", infill);
    assert.deepEqual(differences(await capture(page), first, 0), [], infill);
    assert.equal((await rows(page))["in-fill"], infill);
    const moving = await watch(page, { key: "ArrowLeft", steps: 8 });
    assert.ok(moving.filled > 100 && moving.holes === 0, `${infill}, moving: ${JSON.stringify(moving)}`);
    const { "filled pixels": none, "exact pixels": all } = await rows(page);
    assert.deepEqual([none, all.replace(/\D/g, "")], ["0", String(size[0] * size[1])]);
    await goTo(page, `iso=58&view=-100.5,35.25,1.7,0.1,-0.05,0.2&infill=${infill}`);
    assert.deepEqual(differences(await capture(page), first, 0), [], `${infill}, again`);
  }
  await page.screenshot({ path: join(output, "filled.png") });
});

test("a picture that rests at the threshold is filled, or shows what is missing", async () => {
  await set("#threshold", 0.5);
  for (const [infill, isFilled] of [["off", false], ["network", true]]) {
    await goTo(page, `${scenes[1].link}&infill=${infill}`);
    await finished(page);
    // Nothing of it is in the cache.
    await goTo(page, scenes[2].link);
    const seen = await watch(page, { steps: 0 });
    const filled = Number((await rows(page))["filled pixels"].replace(/\D/g, ""));
    assert.equal(seen.holes > 0, !isFilled, `${infill}: ${JSON.stringify(seen)}`);
    assert.equal(filled > 0, isFilled, `${infill}: ${filled}`);
  }
  await set("#threshold", 1);
  await set("#budget", 8);
});

test("a link restores the in-fill", async () => {
  await page.selectOption("#infill", "classical");
  await page.locator("#share").click();
  const link = new URL(page.url());
  assert.match(link.hash, /&infill=classical$/);
  const other = await open(browser, link.hash.slice(1));
  await loaded(other.page, "brain.zfp");
  assert.equal(await other.page.locator("#infill").inputValue(), "classical");
  await other.context.close();
  await page.selectOption("#infill", "network");
});

test("everything is reached by keyboard, in the order of the page, and has a name", async () => {
  await page.locator("#canvas").focus();
  const visited = [];
  for (let i = 0; i < 20; i++) {
    visited.push(await page.evaluate(() => document.activeElement.id));
    await page.keyboard.press("Tab");
    if ((await page.evaluate(() => document.activeElement)) === null) break;
  }
  const expected = ["canvas", "isovalue-number", "isovalue", "save", "share", "reset", "url", "", "file",
    "scale", "budget", "threshold", "strategy", "infill"];
  assert.deepEqual(visited.slice(0, expected.length), expected);
  const nameless = await page.evaluate(() =>
    [...document.querySelectorAll("button, input, select, progress, meter, [tabindex]")]
      .filter((e) => !(e.labels?.length || e.getAttribute("aria-label") || e.textContent.trim())).map((e) => e.outerHTML));
  assert.deepEqual(nameless, []);
});

test("a large file is never in the page's memory as a whole", async () => {
  const memory = () => page.evaluate(() => window.page.measurements().memory);
  const before = await memory();
  const large = reference("large.zfp");
  await page.route("**/large.zfp", (route) => route.fulfill({ body: large }));
  await page.locator("#url").fill(new URL("large.zfp", process.env.PAGE).href);
  await page.locator("#open-url button").click();
  const progress = await page.evaluate(async () => {
    const shares = new Set();
    while (document.getElementById("name").textContent !== "large.zfp" && document.getElementById("message").hidden) {
      await new Promise((done) => setTimeout(done));
      if (!document.getElementById("loading").hidden) shares.add(document.getElementById("progress").value);
    }
    return [...shares];
  });
  const between = progress.filter((share) => share > 0 && share < 1);
  assert.ok(between.length > 3, `the progress bar: ${progress}`);
  await loaded(page, "large.zfp");
  const grown = (await memory()) - before;
  assert.ok(large.length > 60_000_000 && grown < 32_000_000, `${grown} bytes for a file of ${large.length}`);
});

test("nothing was complained about", () => assert.deepEqual(complaints, []));

test("without WebGPU the page says so", async () => {
  const hidden = () => Object.defineProperty(Navigator.prototype, "gpu", { get: () => undefined });
  const { page, complaints, context } = await open(browser, "", {}, hidden);
  await page.locator("#message").waitFor({ state: "visible" });
  assert.match(await page.locator("#message p").innerText(), /no WebGPU/);
  await page.screenshot({ path: join(output, "without-webgpu.png") });
  assert.deepEqual(complaints, []);
  await context.close();
});

const screens = {
  desktop: { viewport: { width: 1280, height: 800 } },
  phone: { viewport: { width: 390, height: 844 }, isMobile: true, hasTouch: true },
};
for (const [name, options] of Object.entries(screens)) {
  test(`the page fits a ${name}`, async () => {
    const { page, complaints, context } = await open(browser, "", options);
    await loaded(page, "brain.zfp");
    const [content, width] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(content <= width, `${content} pixels of content in ${width}`);
    if (name === "phone") await pinch(page);
    await page.screenshot({ path: join(output, `${name}.png`) });
    await page.screenshot({ path: join(output, `${name}-full.png`), fullPage: true });
    assert.deepEqual(complaints, []);
    await context.close();
  });
}

test("a canvas of WebGPU shows the same as the copy", { skip: !process.env.SCREEN && "no X server" }, async () => {
  const browser = await launchOnScreen(process.env.SCREEN);
  const shots = [];
  for (const query of ["", "?present=copy"]) {
    const { page, complaints, context } = await open(browser, scenes[1].link, {}, undefined, query);
    await loaded(page, "brain.zfp");
    await page.locator("#canvas").press("ArrowLeft");
    await finished(page);
    // Its edges are blended differently over the two kinds of canvas.
    await page.locator("#hint").evaluate((hint) => (hint.hidden = true));
    // What is finished is on the screen some frames later.
    const shoot = () => page.locator("#canvas").screenshot();
    let [last, shot] = [null, await shoot()];
    while (last === null || !shot.equals(last)) [last, shot] = [shot, await shoot()];
    shots.push(await pixels(page, shot));
    await page.screenshot({ path: join(output, query ? "screen-copy.png" : "screen-canvas.png") });
    assert.deepEqual(complaints, []);
    await context.close();
  }
  await browser.close();
  assert.ok(new Set(shots[1].toString("latin1").match(/.{4}/gs)).size > 100, "a picture");
  assert.ok(shots[0].equals(shots[1]), `${changedShare(shots[0], shots[1])} of the picture differ`);
});

/** The pixels of a PNG. */
async function pixels(page, bytes) {
  const values = await page.evaluate(async (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const picture = await createImageBitmap(new Blob([bytes]));
    const context = new OffscreenCanvas(picture.width, picture.height).getContext("2d");
    context.drawImage(picture, 0, 0);
    return Array.from(context.getImageData(0, 0, picture.width, picture.height).data);
  }, bytes.toString("base64"));
  return Buffer.from(values);
}

/** Two fingers that part bring the volume nearer. */
async function pinch(page) {
  const before = await capture(page);
  const hits = ({ status }) => status.filter((s) => s === 1).length;
  const client = await page.context().newCDPSession(page);
  const touch = (type, ...xs) =>
    client.send("Input.dispatchTouchEvent", { type, touchPoints: xs.map((x, id) => ({ x, y: 200, id })) });
  await touch("touchStart", 150, 240);
  await touch("touchMove", 140, 250);
  await touch("touchMove", 130, 260);
  await touch("touchEnd");
  const nearer = await capture(page);
  assert.ok(hits(nearer) > 1.2 * hits(before));
  await touch("touchStart", 150);
  await touch("touchMove", 190);
  await touch("touchEnd");
  assert.ok(changedShare((await capture(page)).color, nearer.color) > 0.02, "one finger turns");
  assert.equal(await page.locator("#hint .touch").isVisible(), true);
}
