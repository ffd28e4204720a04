// A text file as C++: `node embed.mjs PAGE OUT` writes a source of linden::page_template(), see engine/view/page_template.hpp.
import { readFile, writeFile } from 'node:fs/promises';

const [page, out] = process.argv.slice(2);
if (!out) throw new Error('node embed.mjs PAGE OUT: says no file to write');
const text = await readFile(page, 'utf8');
const piece = 15000;  // characters: compilers bound the length of one literal, not of several in a row
const pieces = [];
for (let at = 0; at < text.length; at += piece) pieces.push(`R"~page~(${text.slice(at, at + piece)})~page~"`);
if (text.includes(')~page~"')) throw new Error('the page contains what ends its literal');
await writeFile(out, `// Made of ${page.split('/').pop()} by engine/view/page/embed.mjs.
#include "engine/view/page_template.hpp"

#ifdef __clang__
#pragma clang diagnostic ignored "-Woverlength-strings"
#endif

namespace linden {

static constexpr char page[] =
${pieces.join('\n')};

std::string_view page_template() { return {page, sizeof page - 1}; }

}  // namespace linden
`);
