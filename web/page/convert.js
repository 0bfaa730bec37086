// The worker in which files become fixed-rate streams: the page goes on, and the memory goes with the worker.

import init, { Converter } from "./web.js";

let converter;
let converted;

const answers = {
  begin({ name, length }) {
    converter = new Converter(name, length);
    return { ready: true };
  },
  piece(buffer) {
    converter.push(new Uint8Array(buffer));
    return { ready: true };
  },
  convert() {
    converted = converter.convert((share) => postMessage({ share }));
    return { geometry: converted.geometry(), about: converted.about(), size: converted.length() };
  },
  take() {
    return { piece: converted.take() };
  },
};

const ready = init();

onmessage = async ({ data }) => {
  try {
    await ready;
    const [[request, value]] = Object.entries(data);
    postMessage(answers[request](value));
  } catch (error) {
    postMessage({ error: error.message ?? String(error) });
  }
};
