'use strict';
// What all parts share: the results, packed files, the state of the page, small helpers.
const report = (() => {
  const data = JSON.parse(document.getElementById('data').textContent);
  const { results, integrators, images } = data;

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const blobBytes = (id) => bytes(document.getElementById(`blob-${id}`).textContent);

  // An element with attributes and children; text is text, never markup.
  const make = (name, attributes = {}, ...children) => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (value === undefined || value === null || value === false) continue;
      if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
      else element.setAttribute(key, value === true ? '' : value);
    }
    element.append(...children.filter((c) => c !== null && c !== undefined));
    return element;
  };

  const figure = (v) => {
    if (v === null || v === undefined || !Number.isFinite(v)) return '—';
    const a = Math.abs(v);
    if (a === 0) return '0';
    if (a >= 1e5 || a < 1e-3) return v.toExponential(2).replace('e+', 'e').replace('-', '−').replace('e-', 'e−');
    return String(Number(v.toPrecision(3)));
  };
  // Two significant digits, three from 100 on.
  const ratio = (v) => (Number.isFinite(v) ? String(Number(v.toPrecision(Math.abs(v) >= 99.5 ? 3 : 2))) : '—');
  const percent = (v) => (Number.isFinite(v) ? `${figure(100 * v)} %` : '—');
  const pValue = (p) => (!Number.isFinite(p) ? '—' : p >= 0.001 ? p.toFixed(3) : p.toExponential(0).replace('-', '−'));

  // Pictures become object URLs when they are first shown.
  const urls = new Map();
  const pictureUrl = (picture) => {
    if (!urls.has(picture.blob)) {
      urls.set(picture.blob, URL.createObjectURL(new Blob([blobBytes(picture.blob)], { type: picture.media })));
    }
    return urls.get(picture.blob);
  };
  const picture = (packed, alt) =>
    make('img', { src: pictureUrl(packed), alt, width: packed.width, height: packed.height, decoding: 'async' });

  const inflate = async (id) => {
    const stream = new Blob([blobBytes(id)]).stream().pipeThrough(new DecompressionStream('deflate'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };

  // Value of every code: half floats with 7 bits of mantissa.
  const valueOfCode = new Float32Array(4096);
  for (let code = 0; code < 4096; code += 1) {
    const exponent = code >> 7;
    const mantissa = code & 127;
    if (exponent === 31) valueOfCode[code] = mantissa ? NaN : Infinity;
    else if (exponent === 0) valueOfCode[code] = (mantissa / 128) * 2 ** -14;
    else valueOfCode[code] = (1 + mantissa / 128) * 2 ** (exponent - 15);
  }

  // The inverse of radiance.rs: planes of floats.
  const unpack = async (id, width, height) => {
    const packed = await inflate(id);
    const pixels = width * height;
    const planes = [];
    for (let at = 0; at < packed.length; at += 2 * pixels) {
      const plane = new Int32Array(pixels);
      for (let i = 0; i < pixels; i += 1) {
        const folded = packed[at + i] | (packed[at + pixels + i] << 8);
        plane[i] = (folded >> 1) ^ -(folded & 1);
      }
      planes.push(plane);
    }
    if (planes.length === 3) {
      for (let i = 0; i < pixels; i += 1) {
        planes[0][i] += planes[1][i];
        planes[2][i] += planes[1][i];
      }
    }
    return planes.map((plane) => {
      const values = new Float32Array(pixels);
      for (let i = 0; i < pixels; i += 1) {
        const left = i % width !== 0;
        const up = i >= width;
        if (left && up) plane[i] += (plane[i - 1] + plane[i - width]) >> 1;
        else if (left) plane[i] += plane[i - 1];
        else if (up) plane[i] += plane[i - width];
        const code = plane[i];
        values[i] = code < 0 ? -valueOfCode[-code] : valueOfCode[code];
      }
      return values;
    });
  };

  const loaded = new Map();
  // Radiance and σ of a packed image, unpacked once.
  const radiance = (packed) => {
    if (!loaded.has(packed.blob)) {
      loaded.set(packed.blob, (async () => {
        const { width, height, linear } = packed;
        const [r, g, b] = await unpack(packed.blob, width, height);
        const sigma = packed.sigma === null ? null : (await unpack(packed.sigma, width, height))[0];
        return { width, height, linear, r, g, b, sigma };
      })());
    }
    return loaded.get(packed.blob);
  };

  // State that several parts show; whoever changes it tells the others by an event.
  const state = {
    scene: 0,
    visible: new Set(integrators),
    stops: 0,
    split: 0.5,
    mode: 'image',
    left: null,
    right: null,
    // Window of the image: centre as a share of its sides, and how many times larger than the whole image.
    view: { x: 0.5, y: 0.5, zoom: 1 },
    x: 'seconds',
    y: 'mse',
  };
  const listeners = new Map();
  const on = (name, f) => listeners.set(name, [...(listeners.get(name) ?? []), f]);
  const tell = (name, ...values) => (listeners.get(name) ?? []).forEach((f) => f(...values));

  const seriesIndex = (name) => Math.max(0, integrators.indexOf(name));
  const seriesColour = (name) => `var(--series-${seriesIndex(name) % 8})`;
  // The colour that a custom property has in the theme of now.
  const colour = (value) => {
    const probe = make('span', { style: `color:${value};display:none` });
    document.body.append(probe);
    const resolved = getComputedStyle(probe).color;
    probe.remove();
    return resolved;
  };

  let next = 0;
  const id = (prefix) => `${prefix}-${(next += 1)}`;

  const select = (label, options, value, change) => {
    const list = make('select', { onchange: (e) => change(e.target.value) });
    for (const [key, text] of options) list.append(make('option', { value: key, selected: key === value }, text));
    return make('label', {}, label, list);
  };

  const say = (text) => {
    document.getElementById('status').textContent = text;
  };

  return {
    data, results, integrators, images, bytes, make, figure, ratio, percent, pValue, picture, radiance, state, on, tell, seriesIndex,
    seriesColour, colour, id, select, say,
  };
})();
