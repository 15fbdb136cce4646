'use strict';
// Sorting of tables, and the tests behind a cell of the matrix of verdicts.
report.tables = (() => {
  const { make, figure, ratio, percent, pValue, results, say } = report;

  const REASONS = {
    both_zero: 'no light', too_noisy: 'noise', never_sampled: 'one never finds it', few_contributions: 'too few hits to judge',
    heavy_tail: 'infinite variance', resolved: '', significant: '',
  };

  // One word for each state, as everywhere.
  const WORDS = { agree: 'no difference found', differ: 'differs', inconclusive: 'needs more samples' };

  const sortable = (table) => {
    const body = table.tBodies[0];
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      if ('unsorted' in head.dataset) return;
      const name = head.textContent;
      const button = make('button', { type: 'button' }, name);
      head.replaceChildren(button);
      button.addEventListener('click', () => {
        const down = head.getAttribute('aria-sort') === 'descending';
        const text = column === 0;
        // Figures begin with the largest, names with the first.
        const ascending = head.hasAttribute('aria-sort') ? down : text;
        heads.forEach((h) => h.removeAttribute('aria-sort'));
        head.setAttribute('aria-sort', ascending ? 'ascending' : 'descending');
        const key = (row) => {
          const cell = row.cells[column];
          if (text) return cell.textContent.trim();
          const value = cell.dataset.value;
          return value === undefined || value === '' ? NaN : Number(value);
        };
        const rows = [...body.rows].map((row) => ({ row, key: key(row) }));
        rows.sort((a, b) => {
          // Who makes a part of the image stays apart.
          const apart = a.row.classList.contains('partial') - b.row.classList.contains('partial');
          if (apart) return apart;
          if (text) return a.key.localeCompare(b.key) * (ascending ? 1 : -1);
          // What has no figure stays below.
          if (Number.isNaN(a.key) || Number.isNaN(b.key)) return Number.isNaN(a.key) - Number.isNaN(b.key);
          return (a.key - b.key) * (ascending ? 1 : -1);
        });
        body.append(...rows.map((r) => r.row));
        say(`Sorted by ${name}, ${ascending ? 'ascending' : 'descending'}.`);
      });
    });
  };

  const badge = (verdict, reason) => {
    const why = REASONS[reason] ? ` (${REASONS[reason]})` : '';
    return make('span', { class: `badge ${verdict}` }, `${WORDS[verdict] ?? verdict}${why}`);
  };

  const showPair = (scene, pair) => {
    const dialog = document.getElementById('pair');
    const row = (name, l) => make('tr', {}, make('th', { scope: 'row' }, name), make('td', {}, figure(l.mean_a)), make('td', {}, figure(l.mean_b)),
      make('td', {}, pValue(l.p)), make('td', {}, percent(l.mdb)), make('td', {}, badge(l.verdict, l.reason)));
    const head = ['Path length', `Mean of ${pair.a}`, `Mean of ${pair.b}`, 'p', 'Detectable bias', 'Verdict'].map((h) => make('th', { scope: 'col' }, h));
    const body = [row('image', pair.image), ...pair.lengths.map((l) => row(String(l.length), l))];
    const unseen = pair.unseen.map((n) => make('p', {}, `${n.integrator} can not make ${percent(n.fraction)} of the image of ${n.of} (${n.reason}); that part is left out.`));
    const t = pair.tiles;
    const tiles = t ? make('p', {}, `${t.columns}×${t.rows} tiles by kind of path, merged to ${t.groups} groups: p = ${pValue(t.p)} `, badge(t.verdict)) : null;
    document.getElementById('pair-body').replaceChildren(
      make('h2', { id: 'pair-title' }, `${pair.a} and ${pair.b} on ${scene.name}`),
      make('p', {}, badge(pair.verdict), ` p = ${pValue(pair.p)} over all tests that may be trusted.`),
      ...unseen,
      make('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Tests' },
        make('table', {}, make('thead', {}, make('tr', {}, ...head)), make('tbody', {}, ...body))),
      ...(tiles ? [tiles] : []),
      make('p', {}, `Efficiency of ${pair.a} over ${pair.b} on what both make: ${ratio(pair.efficiency_ratio)}.`));
    dialog.showModal();
  };

  const mount = () => {
    document.querySelectorAll('table.sortable').forEach(sortable);
    for (const button of document.querySelectorAll('[data-pair]')) {
      const scene = results.scenes[Number(button.closest('[data-scene]').dataset.scene)];
      button.addEventListener('click', () => showPair(scene, scene.pairs[Number(button.dataset.pair)]));
    }
  };

  return { mount };
})();
