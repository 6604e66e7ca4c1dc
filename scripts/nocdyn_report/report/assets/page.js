"use strict";
// Tables that sort by their heads, and the choice of colours.
(() => {
  const order = new Intl.Collator("en", { numeric: true });

  function key(row, column) {
    const cell = row.cells[column];
    return cell.dataset.key === undefined ? cell.textContent : Number(cell.dataset.key === "inf" ? Infinity : cell.dataset.key);
  }

  function compare(a, b) {
    return typeof a === "number" && typeof b === "number" ? (a < b ? -1 : a > b ? 1 : 0) : order.compare(String(a), String(b));
  }

  function sort(table, rows, column, head) {
    const now = head.getAttribute("aria-sort");
    const next = now === "ascending" ? "descending" : now === "descending" ? "none" : "ascending";
    table.querySelectorAll("th").forEach((one) => one.setAttribute("aria-sort", "none"));
    head.setAttribute("aria-sort", next);
    const sorted = [...rows];
    if (next !== "none") sorted.sort((a, b) => (next === "ascending" ? 1 : -1) * compare(key(a, column), key(b, column)));
    table.tBodies[0].append(...sorted);
  }

  for (const table of document.querySelectorAll("table[data-sorts]")) {
    const rows = [...table.tBodies[0].rows];
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      head.setAttribute("aria-sort", "none");
      button.addEventListener("click", () => sort(table, rows, column, head));
    });
  }

  const choices = [...document.querySelectorAll("[data-theme-choice]")];
  for (const button of choices) {
    button.addEventListener("click", () => {
      const theme = button.dataset.themeChoice;
      if (theme === "auto") delete document.documentElement.dataset.theme;
      else document.documentElement.dataset.theme = theme;
      choices.forEach((one) => one.setAttribute("aria-pressed", String(one === button)));
    });
  }
})();
