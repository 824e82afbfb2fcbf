// A click on the head of a sortable table sorts its rows, and once more turns them round.
for (const head of document.querySelectorAll(".sortable th")) head.onclick = () => {
  const up = head.ariaSort !== "ascending", column = head.cellIndex, body = head.closest("table").tBodies[0];
  for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
  head.ariaSort = up ? "ascending" : "descending";
  const key = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent;
  const number = (text) => (text === "" ? Infinity : +text);
  const compare = (a, b) => (Number.isNaN(number(a)) ? a.localeCompare(b) : number(a) - number(b));
  body.append(...[...body.rows].sort((a, b) => (up ? 1 : -1) * compare(key(a), key(b))));
};
