'use strict';
// Error against time, by uPlot.
report.curves = (() => {
  const { make, figure, state, on, tell, seriesIndex, seriesColour, colour, select, integrators } = report;

  const X = { seconds: 'seconds', cpu_seconds: 'processor seconds', spp: 'samples per pixel', rays: 'rays' };
  const Y = { mse: 'MSE', relmse: 'relMSE', relmse_trimmed: 'trimmed relMSE', flip: 'FLIP' };
  const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3]];

  const positive = (v) => (Number.isFinite(v) && v > 0 ? v : null);
  const dash = (name) => DASHES[Math.floor(seriesIndex(name) / 8) % DASHES.length];

  // The points of an integrator that can stand on logarithmic axes, from left to right.
  const curve = (method, x, y) => {
    const points = [];
    for (const p of method.points) {
      const at = positive(p[x]);
      const value = positive(y === 'mse' ? p.mse.value : p[y]);
      if (at === null || value === null) continue;
      // Only the MSE has an interval; an end at or below 0 is off the axis.
      const low = y === 'mse' ? positive(p.mse.low) : null;
      const high = y === 'mse' ? positive(p.mse.high) : null;
      points.push({ at, value, low, high });
    }
    return points.sort((a, b) => a.at - b.at);
  };

  const range = (values) => {
    const finite = values.filter((v) => v !== null);
    if (!finite.length) return [0.1, 10];
    const [low, high] = [Math.min(...finite), Math.max(...finite)];
    const margin = Math.max((high / low) ** 0.06, 1.25);
    return [low / margin, high * margin];
  };

  const ticks = (v) => {
    if (v === null) return null;
    if (v >= 1e-2 && v < 1e4) return String(Number(v.toPrecision(2)));
    const digits = { '-': '⁻', 0: '⁰', 1: '¹', 2: '²', 3: '³', 4: '⁴', 5: '⁵', 6: '⁶', 7: '⁷', 8: '⁸', 9: '⁹' };
    const [m, e] = v.toExponential(0).split('e');
    const power = `10${[...String(Number(e))].map((c) => digits[c]).join('')}`;
    return m === '1' ? power : `${m}·${power}`;
  };

  // 1, 2 and 5 times the powers of ten where few decades are shown, else the powers alone.
  const splits = (u, axis, low, high) => {
    const decades = Math.log10(high / low);
    const length = axis === 0 ? u.bbox.width / devicePixelRatio : u.bbox.height / devicePixelRatio;
    const room = length / Math.max(decades, 0.1);
    const steps = room > (axis === 0 ? 170 : 110) ? [1, 2, 5] : [1];
    const every = Math.max(1, Math.ceil((axis === 0 ? 60 : 34) / room));
    const found = [];
    for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); e += 1) {
      if (e % every !== 0) continue;
      for (const m of steps) {
        const v = Number(`${m}e${e}`);
        if (v >= low && v <= high) found.push(v);
      }
    }
    return found;
  };

  const options = (shown, curves, size, x, y) => {
    const ink = colour('var(--soft)');
    const grid = { stroke: colour('var(--line)'), width: 1 };
    const axis = { stroke: ink, grid, ticks: grid, font: '12px system-ui, sans-serif', labelFont: '600 12px system-ui, sans-serif', splits, filter: (u, v) => v, values: (u, v) => v.map(ticks) };
    const series = [{}];
    const bands = [];
    for (const method of shown) {
      const stroke = colour(seriesColour(method.integrator));
      const line = { stroke, width: 2, spanGaps: true, dash: dash(method.integrator), points: { show: true, size: 7, fill: stroke } };
      const edge = { stroke: 'transparent', width: 0, spanGaps: true, points: { show: false } };
      const n = series.length;
      series.push({ ...line, label: method.integrator }, edge, edge);
      bands.push({ series: [n + 2, n + 1], fill: stroke.replace('rgb(', 'rgba(').replace(')', ', 0.16)') });
    }
    const all = curves.flat();
    const xs = range(all.map((p) => p.at));
    const ys = range(all.flatMap((p) => [p.value, p.low, p.high]));
    return {
      ...size,
      // Room for the names at the right.
      padding: [10, Math.min(size.width * 0.22, 14 + 7.4 * Math.max(0, ...shown.map((a) => a.integrator.length))), 0, 0],
      legend: { show: false },
      cursor: { drag: { x: false, y: false }, points: { show: false }, y: false },
      scales: { x: { time: false, distr: 3, log: 10, range: () => xs }, y: { distr: 3, log: 10, range: () => ys } },
      axes: [{ ...axis, label: X[x], size: 42 }, { ...axis, label: Y[y], size: 62 }],
      series, bands,
      hooks: { drawAxes: [(u) => guides(u, xs, ys, shown, curves)], draw: [(u) => whiskers(u, shown, curves)] },
    };
  };

  // Lines of slope −1 through the middle of the axes, a decade of efficiency apart.
  const guides = (u, xs, ys, shown, curves) => {
    if (!curves.some((c) => c.length)) return;
    const { ctx } = u;
    const { left, top, width, height } = u.bbox;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    ctx.strokeStyle = colour('var(--soft)');
    ctx.globalAlpha = 0.45;
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([5 * devicePixelRatio, 6 * devicePixelRatio]);
    const least = Math.floor(Math.log10(xs[0] * ys[0]));
    const most = Math.ceil(Math.log10(xs[1] * ys[1]));
    for (let e = least; e <= most; e += 1) {
      const k = 10 ** e;
      ctx.beginPath();
      ctx.moveTo(u.valToPos(xs[0], 'x', true), u.valToPos(k / xs[0], 'y', true));
      ctx.lineTo(u.valToPos(xs[1], 'x', true), u.valToPos(k / xs[1], 'y', true));
      ctx.stroke();
    }
    ctx.restore();
  };

  // The interval of each point as a bar, and the name at the last point.
  const whiskers = (u, shown, curves) => {
    const { ctx } = u;
    const d = devicePixelRatio;
    ctx.save();
    ctx.font = `600 ${12 * d}px system-ui, sans-serif`;
    ctx.textBaseline = 'middle';
    const taken = [];
    shown.forEach((method, i) => {
      const points = curves[i];
      ctx.strokeStyle = colour(seriesColour(method.integrator));
      ctx.fillStyle = ctx.strokeStyle;
      ctx.lineWidth = 1.5 * d;
      for (const p of points) {
        if (p.low === null || p.high === null) continue;
        const x = u.valToPos(p.at, 'x', true);
        ctx.beginPath();
        ctx.moveTo(x, u.valToPos(p.low, 'y', true));
        ctx.lineTo(x, u.valToPos(p.high, 'y', true));
        ctx.stroke();
      }
      const last = points.at(-1);
      if (!last) return;
      const wide = ctx.measureText(method.integrator).width;
      const x = Math.min(u.valToPos(last.at, 'x', true) + 9 * d, ctx.canvas.width - wide - 2 * d);
      let y = u.valToPos(last.value, 'y', true);
      while (taken.some((t) => Math.abs(t.y - y) < 14 * d && x < t.x + t.wide && t.x < x + wide)) y -= 14 * d;
      taken.push({ x, y, wide });
      ctx.lineJoin = 'round';
      ctx.lineWidth = 4 * d;
      ctx.save();
      ctx.strokeStyle = colour('var(--surface)');
      ctx.strokeText(method.integrator, x, y);
      ctx.restore();
      ctx.fillText(method.integrator, x, y);
    });
    ctx.restore();
  };

  const describe = (shown, curves, x, y) => {
    const parts = shown.flatMap((method, i) => {
      const last = curves[i].at(-1);
      return last ? [`${method.integrator}: ${Y[y]} ${figure(last.value)} at ${figure(last.at)} ${X[x]}`] : [];
    });
    return parts.length ? `${Y[y]} against ${X[x]}, logarithmic. ${parts.join('; ')}.` : 'No point can be shown.';
  };

  const mount = (element, scene) => {
    const named = report.id('curves');
    const available = Object.entries(Y).filter(([y]) => y === 'mse' || scene.methods.some((a) => a.points.some((p) => positive(p[y]))));
    const axes = make('div', { class: 'controls' },
      select('Error', available, state.y, (v) => { state.y = v; tell('curves'); }),
      select('Against', Object.entries(X), state.x, (v) => { state.x = v; tell('curves'); }));
    const choices = make('div', { class: 'choices' });
    for (const method of scene.methods) {
      const name = method.integrator;
      const box = make('input', {
        type: 'checkbox', 'data-toggle': name, onchange: (e) => {
          if (e.target.checked) state.visible.add(name);
          else state.visible.delete(name);
          tell('curves');
        },
      });
      const style = `--swatch:${seriesColour(name)}${seriesIndex(name) >= 8 ? ';border-top-style:dashed' : ''}`;
      choices.append(make('label', {}, box, make('span', { class: 'line', style, 'aria-hidden': 'true' }), name));
    }
    const legend = make('fieldset', {}, make('legend', {}, 'Integrators'), choices);
    const plot = make('div', { class: 'plot', tabindex: 0, role: 'img', 'data-plot': '', 'aria-describedby': named });
    const tip = make('div', { class: 'tip', hidden: true });
    const spoken = make('p', { class: 'visually-hidden', 'aria-live': 'polite' });
    const hint = make('p', { class: 'note', id: named }, 'With the chart in focus, the arrow keys go from point to point.');
    element.append(axes, legend, plot, spoken, hint);

    let u = null;
    let points = [];
    const show = (at, quiet) => {
      const p = points[at];
      tip.hidden = !p;
      if (!p) return;
      const near = points.filter((q) => Math.abs(Math.log(q.at / p.at)) < 0.04 * Math.log(u.scales.x.max / u.scales.x.min));
      const rows = near.map((q) => make('tr', {},
        make('th', { scope: 'row' }, make('span', { class: 'swatch', style: `--swatch:${seriesColour(q.name)}` }), q.name),
        make('td', {}, figure(q.at)), make('td', {}, figure(q.value), q.low === null ? '' : make('small', {}, ` [${figure(q.low)}, ${figure(q.high)}]`))));
      tip.replaceChildren(make('p', {}, `${X[state.x]}, ${Y[state.y]}`), make('table', {}, make('tbody', {}, ...rows)));
      const x = u.valToPos(p.at, 'x') + u.bbox.left / devicePixelRatio;
      const y = u.valToPos(p.value, 'y') + u.bbox.top / devicePixelRatio;
      tip.style.left = `${Math.max(0, Math.min(x + 16, plot.clientWidth - tip.offsetWidth))}px`;
      const below = y + 16 + tip.offsetHeight < plot.clientHeight;
      tip.style.top = `${below ? y + 16 : Math.max(0, y - tip.offsetHeight - 12)}px`;
      if (!quiet) spoken.textContent = near.map((q) => `${q.name}: ${figure(q.at)} ${X[state.x]}, ${Y[state.y]} ${figure(q.value)}`).join('; ');
    };

    let focused = -1;
    const draw = () => {
      for (const box of choices.querySelectorAll('input')) box.checked = state.visible.has(box.dataset.toggle);
      const [error, against] = axes.querySelectorAll('select');
      if (available.every(([y]) => y !== state.y)) state.y = 'mse';
      [error.value, against.value] = [state.y, state.x];
      const shown = scene.methods.filter((a) => state.visible.has(a.integrator));
      const curves = shown.map((a) => curve(a, state.x, state.y));
      points = shown.flatMap((a, i) => curves[i].map((p) => ({ ...p, name: a.integrator }))).sort((a, b) => a.at - b.at);
      const xs = [...new Set(points.map((p) => p.at))];
      const index = new Map(xs.map((x, i) => [x, i]));
      const columns = curves.flatMap((points) => ['value', 'low', 'high'].map((key) => {
        const column = new Array(xs.length).fill(null);
        for (const p of points) column[index.get(p.at)] = p[key];
        return column;
      }));
      u?.destroy();
      plot.replaceChildren();
      const width = Math.max(plot.clientWidth, 240);
      const size = { width, height: Math.round(Math.min(460, Math.max(280, width * 0.52))) };
      u = new uPlot(options(shown, curves, size, state.x, state.y), [xs, ...columns], plot);
      plot.append(tip);
      tip.hidden = true;
      focused = -1;
      plot.setAttribute('aria-label', describe(shown, curves, state.x, state.y));
      plot.dataset.curves = String(curves.filter((c) => c.length).length);
    };

    plot.addEventListener('pointermove', (e) => {
      if (!u) return;
      const box = u.over.getBoundingClientRect();
      const distance = (p) => Math.hypot(u.valToPos(p.at, 'x') - (e.clientX - box.left), u.valToPos(p.value, 'y') - (e.clientY - box.top));
      let best = -1;
      points.forEach((p, i) => { if (best < 0 || distance(p) < distance(points[best])) best = i; });
      show(best >= 0 && distance(points[best]) < 60 ? best : -1, true);
    });
    plot.addEventListener('pointerleave', () => { tip.hidden = true; });
    plot.addEventListener('blur', () => { tip.hidden = true; });
    plot.addEventListener('keydown', (e) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[e.key];
      if (e.key === 'Escape') tip.hidden = true;
      if (!step || !points.length) return;
      e.preventDefault();
      focused = focused < 0 && step < 0 ? points.length - 1 : Math.min(Math.max(focused + step, 0), points.length - 1);
      show(focused, false);
    });

    // A part that is not shown has no size; it is drawn when it gets one.
    let drawn = 0;
    new ResizeObserver(() => {
      if (plot.clientWidth > 0 && Math.abs(plot.clientWidth - drawn) > 1) {
        drawn = plot.clientWidth;
        draw();
      }
    }).observe(plot);
    const redraw = () => { if (plot.clientWidth > 0) draw(); else drawn = 0; };
    on('curves', redraw);
    document.addEventListener('themechange', redraw);
  };

  return { mount };
})();
