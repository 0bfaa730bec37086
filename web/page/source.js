// Where volumes come from: addresses and files, as one stream of bytes each.

/** A volume at an address: its name, its bytes, how many there are (0: not known). */
export async function fromUrl(url, signal) {
  let response;
  try {
    response = await fetch(url, { signal });
  } catch (error) {
    if (signal.aborted) throw error;
    throw new Error(`${url} cannot be reached. It may not exist, or its server may not let other pages read it (CORS).`);
  }
  if (!response.ok) throw new Error(`${url}: the server answers ${response.status} ${response.statusText}`);
  const isEncoded = response.headers.has("content-encoding");
  const length = isEncoded ? 0 : Number(response.headers.get("content-length") ?? 0);
  const name = decodeURIComponent(new URL(response.url).pathname.split("/").pop() || "volume");
  return { name, length, bytes: response.body };
}

/** A volume in a file of this computer. */
export function fromFile(file) {
  return { name: file.name, length: file.size, bytes: file.stream() };
}

/** The pieces of a stream; the first one holds at least `least` bytes, if there are so many. */
export async function* pieces(stream, least) {
  const reader = stream.getReader();
  let first = new Uint8Array(0);
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (first === null) {
        if (done) return;
        yield value;
        continue;
      }
      const joined = new Uint8Array(first.length + (value?.length ?? 0));
      joined.set(first);
      if (value) joined.set(value, first.length);
      if (done || joined.length >= least) {
        yield joined;
        first = null;
        if (done) return;
      } else {
        first = joined;
      }
    }
  } finally {
    reader.cancel().catch(() => {});
  }
}

/**
 * What a worker makes of a file that cannot be streamed as it is. `tell` hears the share that is done.
 * Gives the geometry, a line about the conversion, and the pieces of a fixed-rate stream.
 */
export async function converted(name, length, incoming, tell, signal) {
  const worker = new Worker(new URL("convert.js", import.meta.url), { type: "module" });
  signal.addEventListener("abort", () => worker.terminate());
  const answer = () =>
    new Promise((resolve, reject) => {
      signal.addEventListener("abort", () => reject(signal.reason));
      worker.onerror = (event) => reject(new Error(event.message || "the conversion failed"));
      worker.onmessage = ({ data }) => {
        if (data.error !== undefined) reject(new Error(data.error));
        else if (data.share !== undefined) tell(data.share);
        else resolve(data);
      };
    });
  const ask = (message, transfer = []) => {
    const answered = answer();
    worker.postMessage(message, transfer);
    return answered;
  };
  try {
    await ask({ begin: { name, length } });
    for await (const piece of incoming) {
      const buffer = piece.byteOffset === 0 && piece.byteLength === piece.buffer.byteLength ? piece.buffer : piece.slice().buffer;
      await ask({ piece: buffer }, [buffer]);
    }
    const { geometry, about, size } = await ask({ convert: true });
    return { geometry, about, length: size, pieces: taken(worker, ask) };
  } catch (error) {
    worker.terminate();
    throw error;
  }
}

async function* taken(worker, ask) {
  try {
    for (;;) {
      const { piece } = await ask({ take: true });
      if (piece.length === 0) return;
      yield piece;
    }
  } finally {
    worker.terminate();
  }
}
