'use strict';
// Pictures that are shown as they are: convergence, path lengths, techniques.
report.pictures = (() => {
  const { make, figure, picture, select, seriesColour } = report;

  const none = (text) => make('p', { class: 'none' }, text);

  const convergence = (element, scene, images) => {
    const methods = scene.methods.map((method, i) => ({ method, ...images.methods[i] })).filter((a) => a.frames.length);
    if (!methods.length) {
      element.append(none('No frames were kept.'));
      return;
    }
    const count = Math.max(...methods.map((a) => a.frames.length));
    const grid = make('div', { class: 'frames' });
    const cells = methods.map((a) => {
      const caption = make('figcaption');
      const holder = make('div');
      grid.append(make('figure', {}, holder, caption));
      return { ...a, caption, holder };
    });
    let step = count - 1;
    let errors = false;
    const slider = make('input', { type: 'range', min: 0, max: count - 1, step: 1, value: step, 'data-frames': '' });
    const now = make('output');
    const draw = () => {
      slider.value = step;
      let label = '';
      for (const c of cells) {
        const list = errors && c.errors.length ? c.errors : c.frames;
        const at = Math.min(step, list.length - 1);
        const p = c.method.points[at];
        const budget = p ? `${figure(p.budget.value)} ${p.budget.kind === 'seconds' ? 's' : 'spp'}` : `frame ${at + 1}`;
        label ||= budget;
        const what = errors ? 'relative error' : 'image';
        const img = picture(list[at], `${what} of ${c.method.integrator} after ${budget}`);
        c.holder.replaceChildren(img);
        c.caption.replaceChildren(make('span', { class: 'swatch', style: `--swatch:${seriesColour(c.method.integrator)}` }),
          make('b', {}, c.method.integrator), p ? ` ${figure(p.seconds)} s, MSE ${figure(p.mse.value)}` : '');
      }
      now.textContent = label;
      slider.setAttribute('aria-valuetext', label);
    };
    let timer = null;
    const play = make('button', { type: 'button', 'aria-pressed': 'false' }, '▶ Play');
    const stop = () => {
      clearInterval(timer);
      timer = null;
      play.textContent = '▶ Play';
      play.setAttribute('aria-pressed', 'false');
    };
    play.addEventListener('click', () => {
      if (timer) {
        stop();
        return;
      }
      play.textContent = '❚❚ Pause';
      play.setAttribute('aria-pressed', 'true');
      step = step === count - 1 ? 0 : step;
      draw();
      timer = setInterval(() => {
        step += 1;
        draw();
        if (step >= count - 1) stop();
      }, 700);
    });
    slider.addEventListener('input', () => {
      stop();
      step = Number(slider.value);
      draw();
    });
    const controls = make('div', { class: 'controls' });
    if (count > 1) controls.append(play, make('label', { class: 'grow' }, make('span', {}, 'Budget ', now), slider));
    if (cells.some((c) => c.errors.length)) {
      const box = make('input', { type: 'checkbox', onchange: (e) => { errors = e.target.checked; draw(); } });
      controls.append(make('label', { class: 'check' }, box, 'Relative error in false colour'));
    }
    element.append(controls, grid);
    draw();
  };

  const paths = (element, scene, images) => {
    const has = (a) => a.lengths.length || a.techniques;
    const options = scene.methods.map((a, i) => [String(i), a.integrator]).filter(([i]) => has(images.methods[i]));
    if (!options.length) {
      element.append(none('No pictures by path length or technique were kept.'));
      return;
    }
    const body = make('div', { class: 'paths' });
    const draw = (i) => {
      const { lengths, techniques } = images.methods[i];
      const name = scene.methods[i].integrator;
      const parts = [];
      if (lengths.length) {
        parts.push(make('h4', {}, 'By path length'), make('div', { class: 'strip', tabindex: 0, role: 'region', 'aria-label': `Path lengths of ${name}` },
          ...lengths.map(([k, p]) => make('figure', {}, picture(p, `paths of length ${k} by ${name}`),
            make('figcaption', {}, make('b', {}, `k = ${k}`), k === 1 ? ' emission' : k === 2 ? ' direct light' : ` ${k - 1} bounces`)))));
      }
      if (techniques) {
        const sheet = make('div', { class: 'sheet', tabindex: 0, role: 'region', 'aria-label': `Techniques of ${name}` },
          picture(techniques, `each technique (s,t) of ${name}, a row for each path length, s grows to the right`));
        const size = make('button', { type: 'button', 'aria-pressed': 'false' }, 'Actual size');
        size.addEventListener('click', () => size.setAttribute('aria-pressed', String(sheet.classList.toggle('actual'))));
        parts.push(make('h4', {}, 'By technique (s,t)'), make('p', {}, size), sheet);
      }
      body.replaceChildren(...parts);
    };
    // The one with the richest techniques first: its sheet packs worst.
    const size = ([i]) => (images.methods[i].techniques ? document.getElementById(`blob-${images.methods[i].techniques.blob}`).textContent.length : 0);
    const first = options.reduce((best, option) => (size(option) > size(best) ? option : best));
    element.append(make('div', { class: 'controls' }, select('Integrator', options, first[0], draw)), body);
    draw(first[0]);
  };

  return { convergence, paths };
})();
