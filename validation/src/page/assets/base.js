'use strict';
// The theme is chosen before anything is drawn, so that a dark page does not flash white.
(() => {
  const KEY = 'pathspace-theme';
  const NEXT = { automatic: 'light', light: 'dark', dark: 'automatic' };
  let theme = 'automatic';
  try {
    theme = localStorage.getItem(KEY) ?? theme;
  } catch {
    // Storage may be closed to files; then the choice lasts as long as the page.
  }
  const apply = () => {
    if (!(theme in NEXT)) theme = 'automatic';
    const root = document.documentElement;
    if (theme === 'automatic') delete root.dataset.theme;
    else root.dataset.theme = theme;
    const button = document.getElementById('theme');
    if (button) button.textContent = `Theme: ${theme}`;
    document.dispatchEvent(new Event('themechange'));
  };
  apply();
  addEventListener('DOMContentLoaded', () => {
    apply();
    document.getElementById('theme')?.addEventListener('click', () => {
      theme = NEXT[theme];
      try {
        localStorage.setItem(KEY, theme);
      } catch {
        // As above.
      }
      apply();
    });
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', apply);
  });
})();
