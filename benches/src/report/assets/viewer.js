'use strict';
// Two images under a line, all others beside them in the same window.
report.viewer = (() => {
  const { make, figure, percent, radiance, state, on, tell, select, tone, say } = report;
  const REFERENCE = '';
  const MODES = { image: 'Image', sigma: 'Noise σ', error: 'Error', difference: 'Left − right' };

  const clamp = (v, low, high) => Math.min(Math.max(v, low), high);

  // Scale and origin of the image in a window of this size.
  const place = (image, width, height) => {
    const scale = Math.min(width / image.width, height / image.height) * state.view.zoom;
    const axis = (pixels, size, at) => {
      const length = pixels * scale;
      return length <= size ? (size - length) / 2 : clamp(size / 2 - at * length, size - length, 0);
    };
    return { scale, x: axis(image.width, width, state.view.x), y: axis(image.height, height, state.view.y) };
  };

  const drawInto = (canvas, picture, from, to) => {
    const context = canvas.getContext('2d');
    const at = place(picture, canvas.width, canvas.height);
    context.save();
    context.beginPath();
    context.rect(from, 0, to - from, canvas.height);
    context.clip();
    context.imageSmoothingEnabled = at.scale < 1;
    context.drawImage(picture, at.x, at.y, picture.width * at.scale, picture.height * at.scale);
    context.restore();
  };

  const mount = async (element, scene, images) => {
    const entries = scene.methods.map((method, i) => ({ key: method.integrator, label: method.integrator, packed: images.methods[i].mean, method })).filter((e) => e.packed);
    if (images.reference) entries.push({ key: REFERENCE, label: 'reference', packed: images.reference });
    if (!entries.length) {
      element.append(make('p', { class: 'none' }, 'There are no images.'));
      return;
    }
    const has = (key) => entries.some((e) => e.key === key);
    const left = () => entries.find((e) => e.key === state.left) ?? entries[0];
    const right = () => entries.find((e) => e.key === state.right) ?? (has(REFERENCE) ? entries.at(-1) : entries[Math.min(1, entries.length - 1)]);
    const modes = Object.keys(MODES).filter((m) => m === 'image' || (m === 'sigma' && entries.some((e) => e.packed.sigma !== null))
      || (m === 'error' && images.reference) || (m === 'difference' && entries.length > 1));
    const mode = () => (modes.includes(state.mode) ? state.mode : 'image');

    const stage = make('div', { class: 'stage', 'data-stage': '' });
    const canvas = make('canvas', { tabindex: 0, role: 'img', 'aria-label': 'Two images under a line', 'data-canvas': '' });
    const handle = make('div', {
      class: 'split', tabindex: 0, role: 'slider', 'aria-label': 'Border between the left and the right image', 'aria-valuemin': 0, 'aria-valuemax': 100,
      'aria-orientation': 'horizontal', 'data-split': '',
    });
    const tags = [make('span', { class: 'tag left' }), make('span', { class: 'tag right' })];
    stage.append(canvas, handle, ...tags);
    const readout = make('p', { class: 'readout', 'aria-live': 'polite' });
    const ramp = make('canvas', { 'aria-hidden': 'true' });
    const ends = [make('span'), make('span')];
    const scale = make('div', { class: 'scale' }, ends[0], ramp, ends[1]);

    const choose = (label, side) => select(label, entries.map((e) => [e.key, e.label]), side === 'left' ? left().key : right().key, (v) => {
      state[side] = v;
      tell('view');
    });
    const chooseLeft = choose('Left', 'left');
    const chooseRight = choose('Right', 'right');
    const group = report.id('mode');
    const radios = make('div', { class: 'choices' }, ...modes.map((m) => make('label', {},
      make('input', { type: 'radio', name: group, value: m, onchange: () => { state.mode = m; tell('view'); } }), MODES[m])));
    const stops = make('input', { type: 'range', min: -6, max: 6, step: 0.25, 'data-exposure': '', oninput: (e) => { state.stops = Number(e.target.value); tell('view'); } });
    const stopsNow = make('output');
    const zoomTo = (zoom) => {
      state.view.zoom = clamp(zoom, 1, 64);
      tell('view');
    };
    const fit = () => Math.min(canvas.width / left().packed.width, canvas.height / left().packed.height);
    const button = (text, label, f) => make('button', { type: 'button', 'aria-label': label, title: label, onclick: f }, text);
    const zooms = make('div', { class: 'label' }, make('span', {}, 'Zoom'), make('span', {},
      button('−', 'Zoom out', () => zoomTo(state.view.zoom / 1.5)), button('+', 'Zoom in', () => zoomTo(state.view.zoom * 1.5)),
      button('Fit', 'Fit the whole image', () => { Object.assign(state.view, { x: 0.5, y: 0.5 }); zoomTo(1); }),
      button('8:1', '8:1, eight screen pixels for one pixel', () => zoomTo((8 * devicePixelRatio) / fit()))));
    const reset = button('Reset', 'Reset the exposure', () => { state.stops = 0; tell('view'); });

    const tiles = make('div', { class: 'tiles' });
    const cells = entries.map((entry) => {
      const small = make('canvas', { role: 'img', 'aria-label': `${entry.label}, same window` });
      const press = make('button', { type: 'button', 'aria-label': `Show ${entry.label} on the left`, onclick: () => { state.left = entry.key; tell('view'); } }, small);
      const error = entry.method?.points.at(-1)?.relmse;
      tiles.append(make('figure', {}, press, make('figcaption', {}, make('b', {}, entry.label), Number.isFinite(error) ? ` relMSE ${figure(error)}` : '')));
      return { entry, small, own: make('canvas') };
    });
    element.append(
      make('div', { class: 'controls' }, chooseLeft, chooseRight, make('fieldset', {}, make('legend', {}, 'Show'), radios)),
      make('div', { class: 'controls' }, make('label', { class: 'grow' }, make('span', {}, 'Exposure ', stopsNow), stops), reset, zooms),
      make('div', { class: 'viewer' }, make('div', {}, stage, scale, readout), tiles));

    // Pixels of an image in the mode of now, painted again only where something changed.
    const painted = new Map();
    let all = null;
    const picture = (cell) => {
      const partner = mode() === 'difference' ? (cell.entry === left() ? right() : left()) : null;
      const key = [mode(), state.stops, partner?.key].join();
      const known = painted.get(cell);
      if (known?.key !== key) {
        const image = all.get(cell.entry.key);
        // Both sides of a difference show left − right.
        const shown = mode() === 'difference' && cell.entry !== left() ? [all.get(left().key), image] : [image, partner && all.get(partner.key)];
        const done = tone.paint(cell.own, mode(), shown[0], shown[1], all.get(REFERENCE), images);
        painted.set(cell, { key, done });
      }
      return painted.get(cell).done ? cell.own : null;
    };

    const empty = (target, from, to) => {
      const context = target.getContext('2d');
      context.fillStyle = '#8b95a1';
      context.font = `${13 * devicePixelRatio}px system-ui, sans-serif`;
      context.textAlign = 'center';
      context.fillText('not known', (from + to) / 2, target.height / 2);
    };
    const draw = () => {
      if (!all || stage.clientWidth === 0) return;
      const first = left().packed;
      const height = Math.round(Math.min((stage.clientWidth * first.height) / first.width, Math.max(240, innerHeight * 0.72)));
      stage.style.height = `${height}px`;
      const size = { width: Math.round(stage.clientWidth * devicePixelRatio), height: Math.round(height * devicePixelRatio) };
      if (canvas.width !== size.width || canvas.height !== size.height) Object.assign(canvas, size);
      canvas.getContext('2d').clearRect(0, 0, canvas.width, canvas.height);
      const difference = mode() === 'difference';
      const split = difference ? canvas.width : Math.round(state.split * canvas.width);
      const cellOf = (entry) => cells.find((c) => c.entry === entry);
      const sides = difference ? [[right(), 0, canvas.width]] : [[left(), 0, split], [right(), split, canvas.width]];
      for (const [entry, from, to] of sides) {
        const shown = picture(cellOf(entry));
        if (shown) drawInto(canvas, shown, from, to);
        else if (to > from) empty(canvas, from, to);
      }
      for (const cell of cells) {
        const width = Math.max(1, Math.round(cell.small.clientWidth * devicePixelRatio));
        Object.assign(cell.small, { width, height: Math.max(1, Math.round((width * canvas.height) / canvas.width)) });
        const shown = picture(cell);
        if (shown) drawInto(cell.small, shown, 0, width);
        else empty(cell.small, 0, width);
      }
      canvas.style.touchAction = state.view.zoom > 1 ? 'none' : 'pan-y';
      handle.hidden = difference;
      handle.style.left = `${100 * state.split}%`;
      handle.setAttribute('aria-valuenow', String(Math.round(100 * state.split)));
      handle.setAttribute('aria-valuetext', `${Math.round(100 * state.split)} % ${left().label}, the rest ${right().label}`);
      tags[0].textContent = difference ? `${left().label} − ${right().label}` : left().label;
      tags[1].textContent = difference ? '' : right().label;
      tags[1].hidden = difference;
      canvas.setAttribute('aria-label', difference ? `${MODES.difference}: ${tags[0].textContent}`
        : `${MODES[mode()]}: ${left().label} on the left, ${right().label} on the right, exposure ${figure(state.stops)} stops`);
      chooseLeft.querySelector('select').value = left().key;
      chooseRight.querySelector('select').value = right().key;
      for (const radio of radios.querySelectorAll('input')) radio.checked = radio.value === mode();
      stops.value = state.stops;
      stopsNow.textContent = `${state.stops > 0 ? '+' : ''}${figure(state.stops).replace('-', '−')} stops`;
      stops.setAttribute('aria-valuetext', stopsNow.textContent);
      scale.hidden = mode() === 'image';
      if (mode() !== 'image') {
        tone.legend(ramp, difference);
        const unit = tone.unit(all.get(left().key), all.get(right().key));
        const range = tone.signedRange(unit);
        const [low, high] = tone.magnitudeRange();
        const text = unit === 'σ' ? `${figure(range)} σ` : percent(range);
        ends[0].textContent = difference ? `−${text}` : percent(low);
        ends[1].textContent = difference ? `+${text} (orange: left is brighter)` : `${percent(high)} of the ${mode() === 'error' ? 'reference' : 'pixel'}`;
      }
    };
    let pending = false;
    const redraw = () => {
      if (pending) return;
      pending = true;
      requestAnimationFrame(() => {
        pending = false;
        draw();
      });
    };

    // Pixel under a point of the stage, or the middle one.
    const read = (clientX, clientY) => {
      if (!all) return;
      const box = canvas.getBoundingClientRect();
      const image = all.get(left().key);
      const at = place(image, box.width, box.height);
      const [px, py] = clientX === undefined ? [box.width / 2, box.height / 2] : [clientX - box.left, clientY - box.top];
      const [x, y] = [Math.floor((px - at.x) / at.scale), Math.floor((py - at.y) / at.scale)];
      if (x < 0 || y < 0 || x >= image.width || y >= image.height) {
        readout.textContent = '';
        return;
      }
      const i = y * image.width + x;
      const line = (entry) => {
        const { r, g, b, sigma } = all.get(entry.key);
        const values = [r[i], g[i], b[i]].map((v) => figure(v / images.scale)).join(' ');
        return `${entry.label}: ${values}${sigma ? ` ± ${figure(sigma[i] / images.scale)}` : ''}`;
      };
      const where = images.factor > 1 ? `block (${x}, ${y})` : `pixel (${x}, ${y})`;
      readout.textContent = [where, line(left()), ...(right() === left() ? [] : [line(right())])].join('\n');
    };

    const pan = (dx, dy) => {
      const image = left().packed;
      const at = place(image, canvas.clientWidth, canvas.clientHeight);
      const move = (value, delta, pixels, size) => {
        const half = size / (2 * pixels * at.scale);
        return half >= 0.5 ? 0.5 : clamp(value + delta / (pixels * at.scale), half, 1 - half);
      };
      state.view.x = move(state.view.x, dx, image.width, canvas.clientWidth);
      state.view.y = move(state.view.y, dy, image.height, canvas.clientHeight);
      tell('view');
    };
    const zoomAt = (factor, clientX, clientY) => {
      const box = canvas.getBoundingClientRect();
      const [dx, dy] = [clientX - box.left - box.width / 2, clientY - box.top - box.height / 2];
      const before = state.view.zoom;
      state.view.zoom = clamp(before * factor, 1, 64);
      const ratio = state.view.zoom / before;
      // What is under the pointer stays there.
      pan(dx * (ratio - 1), dy * (ratio - 1));
    };

    const down = new Map();
    canvas.addEventListener('pointerdown', (e) => {
      down.set(e.pointerId, e);
      canvas.setPointerCapture(e.pointerId);
      canvas.classList.add('dragging');
    });
    canvas.addEventListener('pointermove', (e) => {
      read(e.clientX, e.clientY);
      const before = down.get(e.pointerId);
      if (!before) return;
      const others = [...down.values()].filter((p) => p.pointerId !== e.pointerId);
      if (others.length) {
        const distance = (p) => Math.hypot(p.clientX - others[0].clientX, p.clientY - others[0].clientY);
        if (distance(before) > 0) zoomAt(distance(e) / distance(before), (e.clientX + others[0].clientX) / 2, (e.clientY + others[0].clientY) / 2);
      } else if (state.view.zoom > 1) {
        pan(before.clientX - e.clientX, before.clientY - e.clientY);
      }
      down.set(e.pointerId, e);
    });
    for (const name of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(name, (e) => {
        down.delete(e.pointerId);
        if (!down.size) canvas.classList.remove('dragging');
      });
    }
    // The wheel scrolls the page until the image has the focus.
    canvas.addEventListener('wheel', (e) => {
      if (!e.ctrlKey && document.activeElement !== canvas) return;
      e.preventDefault();
      zoomAt(2 ** (-e.deltaY / 300), e.clientX, e.clientY);
    }, { passive: false });
    canvas.addEventListener('dblclick', (e) => zoomAt(2, e.clientX, e.clientY));
    canvas.addEventListener('keydown', (e) => {
      const step = 0.25 * canvas.clientWidth;
      const act = {
        ArrowLeft: () => pan(-step, 0), ArrowRight: () => pan(step, 0), ArrowUp: () => pan(0, -step), ArrowDown: () => pan(0, step),
        '+': () => zoomTo(state.view.zoom * 1.5), '=': () => zoomTo(state.view.zoom * 1.5), '-': () => zoomTo(state.view.zoom / 1.5), 0: () => zoomTo(1),
      }[e.key];
      if (!act || e.ctrlKey || e.metaKey || e.altKey) return;
      // At the whole image the arrows scroll the page.
      if (e.key.startsWith('Arrow') && state.view.zoom === 1) return;
      e.preventDefault();
      act();
      read();
    });

    const setSplit = (v) => {
      state.split = clamp(v, 0, 1);
      tell('view');
    };
    handle.addEventListener('pointerdown', (e) => {
      handle.setPointerCapture(e.pointerId);
      handle.focus();
      e.preventDefault();
    });
    handle.addEventListener('pointermove', (e) => {
      if (!handle.hasPointerCapture(e.pointerId)) return;
      const box = stage.getBoundingClientRect();
      setSplit((e.clientX - box.left) / box.width);
    });
    handle.addEventListener('keydown', (e) => {
      const step = e.shiftKey ? 0.1 : 0.02;
      const to = {
        ArrowLeft: state.split - step, ArrowDown: state.split - step, ArrowRight: state.split + step, ArrowUp: state.split + step,
        PageDown: state.split - 0.1, PageUp: state.split + 0.1, Home: 0, End: 1,
      }[e.key];
      if (to === undefined) return;
      e.preventDefault();
      setSplit(to);
    });

    on('view', redraw);
    on('print', draw);
    let width = 0;
    new ResizeObserver(() => {
      if (stage.clientWidth !== width) {
        width = stage.clientWidth;
        redraw();
      }
    }).observe(stage);
    try {
      all = new Map(await Promise.all(entries.map(async (e) => [e.key, await radiance(e.packed)])));
      stage.dataset.loaded = 'true';
      redraw();
    } catch (error) {
      element.replaceChildren(make('p', { class: 'none' }, `The images can not be unpacked: ${error.message}`));
      say('The images can not be unpacked.');
    }
  };

  return { mount };
})();
