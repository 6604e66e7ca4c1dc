// Fills search.html?q=WORDS from the index that docs/search_index.py has made.
const shown = 40
const words = new URLSearchParams(location.search).get('q') ?? ''

function element(name, text, attributes = {}) {
  const made = Object.assign(document.createElement(name), attributes)
  made.textContent = text
  return made
}

// The text around the first word that was asked for.
function excerpt(text, terms) {
  const places = terms.map(term => text.toLowerCase().indexOf(term)).filter(place => place >= 0)
  const start = Math.max(0, Math.min(...places, text.length) - 60)
  const from = places.length > 0 ? start : 0
  return (from > 0 ? '… ' : '') + text.slice(from, from + 220) + (text.length > from + 220 ? ' …' : '')
}

function show() {
  const terms = words.toLowerCase().match(/[\p{L}\p{N}_]+/gu) ?? []
  const query = terms.map(term => `${term}^10 ${term}*`).join(' ')
  const found = terms.length > 0 ? lunr.Index.load(site.index).search(query) : []
  const target = document.getElementById('lunrsearchresults')
  const list = element('ul', '')
  for (const result of found.slice(0, shown)) {
    const page = site.documents[Number(result.ref)]
    const item = element('li', '')
    item.append(element('a', page.title, { href: page.url }), ` (${page.part})`, element('br', ''), excerpt(page.text, terms))
    list.append(item)
  }
  target.replaceChildren(element('p', `${found.length} results for '${words}'`), list)
  document.querySelector('input[name=q]').value = words
}

show()
