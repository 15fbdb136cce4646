'use strict';
// From radiance to pixels of a canvas: exposure and sRGB, or false colour.
report.tone = (() => {
  const { data, bytes, state } = report;

  const maps = { magnitude: bytes(data.maps.magnitude), signed: bytes(data.maps.signed) };
  // sRGB's transfer curve (IEC 61966-2-1), fine enough for less than a code of 8 bits.
  const STEPS = 16384;
  const curve = new Uint8ClampedArray(STEPS + 1);
  for (let i = 0; i <= STEPS; i += 1) {
    const v = i / STEPS;
    curve[i] = 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055) + 0.5;
  }

  const luminance = (image, i) => 0.2126 * image.r[i] + 0.7152 * image.g[i] + 0.0722 * image.b[i];

  // Ranges of the false colours at the exposure of now: three decades of a ratio, or ± so many σ.
  const magnitudeRange = () => [1e-3 * 2 ** -state.stops, 2 ** -state.stops];
  const signedRange = (unit) => (unit === 'σ' ? 4 : 0.5) * 2 ** -state.stops;

  const toMagnitude = (v) => {
    const [low, high] = magnitudeRange();
    return Math.log(v / low) / Math.log(high / low);
  };

  // Fills RGBA with f(i) ∈ [0, 1] through a map; what is not a number becomes magenta.
  const through = (map, rgba, pixels, f) => {
    for (let i = 0; i < pixels; i += 1) {
      const t = f(i);
      const at = Number.isNaN(t) ? -1 : 3 * Math.round(255 * Math.min(Math.max(t, 0), 1));
      rgba[4 * i] = at < 0 ? 255 : map[at];
      rgba[4 * i + 1] = at < 0 ? 0 : map[at + 1];
      rgba[4 * i + 2] = at < 0 ? 255 : map[at + 2];
      rgba[4 * i + 3] = 255;
    }
  };

  const paintRadiance = (image, rgba, exposure) => {
    const gain = STEPS * 2 ** state.stops * (image.linear ? exposure : 1);
    const pixels = image.width * image.height;
    const { r, g, b } = image;
    for (let i = 0; i < pixels; i += 1) {
      const bad = !Number.isFinite(r[i] + g[i] + b[i]);
      rgba[4 * i] = bad ? 255 : curve[Math.min(STEPS, Math.max(0, (r[i] * gain) | 0))];
      rgba[4 * i + 1] = bad ? 0 : curve[Math.min(STEPS, Math.max(0, (g[i] * gain) | 0))];
      rgba[4 * i + 2] = bad ? 255 : curve[Math.min(STEPS, Math.max(0, (b[i] * gain) | 0))];
      rgba[4 * i + 3] = 255;
    }
  };

  // σ pooled over tiles of 8×8 pixels: from few replicates that of one pixel is itself noise, and is too small just where the rare
  // bright samples did not come.
  const TILE = 8;
  const pools = new WeakMap();
  const pooled = (image) => {
    if (pools.has(image)) return pools.get(image);
    const { width, height, sigma } = image;
    const across = Math.ceil(width / TILE);
    const sums = new Float64Array(across * Math.ceil(height / TILE));
    const counts = new Float64Array(sums.length);
    const tile = (i) => Math.floor(Math.floor(i / width) / TILE) * across + Math.floor((i % width) / TILE);
    for (let i = 0; i < width * height; i += 1) {
      if (!Number.isFinite(sigma[i])) continue;
      sums[tile(i)] += sigma[i] * sigma[i];
      counts[tile(i)] += 1;
    }
    const f = (i) => sums[tile(i)] / Math.max(1, counts[tile(i)]);
    pools.set(image, f);
    return f;
  };

  // What a mode shows of an image beside its partner and the reference: a function of the pixel, or null where it can not be shown.
  const measure = (mode, image, partner, reference, level) => {
    // The relative error of relMSE: ε = 10⁻²·(mean luminance)².
    const size = (v) => Math.sqrt(v * v + 0.01 * level * level) || 1e-12;
    if (mode === 'sigma') return image.sigma && ((i) => image.sigma[i] / size(luminance(image, i)));
    if (mode === 'error') {
      return reference && image.linear && ((i) => {
        const r = luminance(reference, i);
        return Math.abs(luminance(image, i) - r) / size(r);
      });
    }
    if (mode === 'difference' && partner) {
      const noise = image.sigma && partner.sigma;
      return (i) => {
        const d = luminance(image, i) - luminance(partner, i);
        if (noise) return d === 0 ? 0 : d / Math.sqrt(pooled(image)(i) + pooled(partner)(i));
        return d / size(0.5 * (luminance(image, i) + luminance(partner, i)));
      };
    }
    return null;
  };
  const unit = (image, partner) => (image?.sigma && partner?.sigma ? 'σ' : '');

  // Paints an image into a canvas of its own size; false where the mode can not show it.
  const paint = (canvas, mode, image, partner, reference, { exposure, level }) => {
    const { width, height } = image;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext('2d');
    const picture = context.createImageData(width, height);
    if (mode === 'image') {
      paintRadiance(image, picture.data, exposure);
    } else {
      const f = measure(mode, image, partner, reference, level);
      if (!f) return false;
      if (mode === 'difference') {
        const range = signedRange(unit(image, partner));
        // Orange where the left image is brighter.
        through(maps.signed, picture.data, width * height, (i) => 0.5 + f(i) / (2 * range));
      } else {
        through(maps.magnitude, picture.data, width * height, (i) => toMagnitude(f(i)));
      }
    }
    context.putImageData(picture, 0, 0);
    return true;
  };

  const legend = (canvas, signed) => {
    Object.assign(canvas, { width: 256, height: 1 });
    const context = canvas.getContext('2d');
    const picture = context.createImageData(256, 1);
    through(signed ? maps.signed : maps.magnitude, picture.data, 256, (i) => i / 255);
    context.putImageData(picture, 0, 0);
  };

  return { paint, legend, measure, unit, magnitudeRange, signedRange };
})();
