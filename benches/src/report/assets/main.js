'use strict';
// Scenes as tabs, parts mounted when their scene is first shown, small conveniences.
(() => {
  const { results, images, state, tell, say, seriesColour } = report;

  for (const swatch of document.querySelectorAll('[data-series]')) swatch.style.setProperty('--swatch', seriesColour(swatch.dataset.series));
  report.tables.mount();

  const mounted = new Set();
  const mount = (s) => {
    if (mounted.has(s)) return;
    mounted.add(s);
    const [scene, pictures] = [results.scenes[s], images[s]];
    const at = (name) => document.querySelector(`#s${s} [data-mount="${name}"]`);
    // With one budget there are dots, drawn already.
    if (at('curves')) report.curves.mount(at('curves'), scene);
    report.viewer.mount(at('viewer'), scene, pictures);
    report.pictures.convergence(at('convergence'), scene, pictures);
    report.pictures.paths(at('paths'), scene, pictures);
  };

  const tabs = [...document.querySelectorAll('[role="tab"]')];
  const show = (s) => {
    state.scene = s;
    tabs.forEach((tab, i) => {
      tab.setAttribute('aria-selected', String(i === s));
      tab.tabIndex = i === s ? 0 : -1;
      document.getElementById(`s${i}`).hidden = i !== s;
    });
    for (const link of document.querySelectorAll('[data-part]')) link.href = `#s${s}-${link.dataset.part}`;
    mount(s);
    tell('curves');
    tell('view');
  };
  tabs.forEach((tab, i) => {
    tab.addEventListener('click', () => show(i));
    tab.addEventListener('keydown', (e) => {
      const n = tabs.length;
      const to = { ArrowRight: (i + 1) % n, ArrowLeft: (i + n - 1) % n, Home: 0, End: n - 1 }[e.key];
      if (to === undefined) return;
      e.preventDefault();
      show(to);
      tabs[to].focus();
    });
  });
  // An address that names a part of a scene shows that scene.
  const follow = () => {
    const found = /^#s(\d+)(-|$)/.exec(location.hash);
    const s = found ? Number(found[1]) : -1;
    if (s >= 0 && s < results.scenes.length && s !== state.scene) {
      show(s);
      document.querySelector(location.hash)?.scrollIntoView();
    }
  };
  if (results.scenes.length) show(0);
  follow();

  // Paper has all scenes, and printing waits for nothing: they are unpacked before, and drawn when it begins.
  const soon = globalThis.requestIdleCallback ?? ((f) => setTimeout(f, 500));
  soon(() => results.scenes.forEach((_, s) => mount(s)));
  addEventListener('beforeprint', () => {
    results.scenes.forEach((_, s) => { document.getElementById(`s${s}`).hidden = false; });
    tell('curves');
    tell('print');
  });
  addEventListener('afterprint', () => show(state.scene));
  addEventListener('hashchange', follow);

  // The part in view is marked in the navigation.
  const links = [...document.querySelectorAll('nav.sections a')];
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      const link = links.find((l) => l.getAttribute('href') === `#${entry.target.id}`);
      if (!link) continue;
      links.forEach((l) => l.removeAttribute('aria-current'));
      link.setAttribute('aria-current', 'true');
    }
  }, { rootMargin: '-15% 0px -70% 0px' });
  document.querySelectorAll('section.card').forEach((part) => seen.observe(part));

  for (const button of document.querySelectorAll('[data-copy]')) {
    if (!navigator.clipboard) continue;
    button.hidden = false;
    button.addEventListener('click', async () => {
      try {
        await navigator.clipboard.writeText(document.getElementById(button.dataset.copy).textContent);
        say('Copied.');
        button.textContent = 'Copied';
        setTimeout(() => { button.textContent = 'Copy'; }, 1500);
      } catch {
        say('The browser does not allow copying.');
      }
    });
  }
  document.documentElement.dataset.ready = 'true';
})();
