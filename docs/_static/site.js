// What themes and notebooks leave out for those who use a keyboard or a screen reader.
function makeFocusable() {
  for (const part of document.querySelectorAll(".table-wrapper, pre, .output, .cell_output, article p:has(> img), .sidebar-scroll, .toc-scroll")) {
    if (part.scrollWidth > part.clientWidth || part.scrollHeight > part.clientHeight) {
      part.tabIndex = 0;
    }
  }
}

function name() {
  document.querySelector("aside.sidebar-drawer")?.setAttribute("aria-label", "All pages");
  document.querySelector("aside.toc-drawer")?.setAttribute("aria-label", "On this page");
  for (const head of document.querySelectorAll("th")) {
    if (!head.textContent.trim()) {
      head.replaceWith(document.createElement("td")); // a corner of a table heads nothing
    }
  }
}

document.addEventListener("DOMContentLoaded", () => {
  name();
  makeFocusable();
});
window.addEventListener("resize", makeFocusable);
