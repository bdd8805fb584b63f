#include "solver/app/report/page.hpp"
#include "io/quote.hpp"
#include <algorithm>
#include <cstdint>
#include <fmt/format.h>

namespace kuzure::report {

namespace {
// Colours of the curves: Tol's bright scheme, told apart by colour-blind readers; lighter on a dark ground.
constexpr const char* style = R"css(
:root{color-scheme:light dark;--ground:#fff;--card:#f5f6f8;--ink:#1c2127;--soft:#5b6572;--line:#d9dde3;--good:#1a7f45;--warn:#9a5b00;--bad:#b3261e;
--c0:#4477aa;--c1:#ee6677;--c2:#228833;--c3:#b8970c;--c4:#2a9fc4;--c5:#aa3377;--c6:#777}
@media (prefers-color-scheme:dark){:root{--ground:#14171b;--card:#1d2228;--ink:#e6e9ed;--soft:#9aa5b1;--line:#343b44;--good:#5cc98b;--warn:#e6b04f;--bad:#ff8a80;
--c0:#7aa9dd;--c1:#ff8c99;--c2:#5fbf6c;--c3:#dcc250;--c4:#66ccee;--c5:#dd77b3;--c6:#a8a8a8}}
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--ink);font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans","DejaVu Sans",sans-serif}
main{max-width:68rem;margin:auto;padding:1.6rem 1.25rem 3rem}
h1{font-size:1.55rem;line-height:1.25;margin:0 0 1rem;overflow-wrap:anywhere}
h2{font-size:1.15rem;margin:2.4rem 0 .8rem;padding-bottom:.3rem;border-bottom:1px solid var(--line)}
p{margin:.4rem 0}.soft,figcaption{color:var(--soft)}figcaption,.small{font-size:.875rem}
.verdict{border-left:.35rem solid var(--c6);background:var(--card);padding:.8rem 1rem;border-radius:.3rem;overflow-wrap:anywhere}
.verdict strong{font-size:1.15rem}
.good{border-color:var(--good)}.warn{border-color:var(--warn)}.bad{border-color:var(--bad)}
.good>strong{color:var(--good)}.warn>strong{color:var(--warn)}.bad>strong{color:var(--bad)}
.cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(9.5rem,1fr));gap:.6rem;margin:1rem 0 0;padding:0}
.cards div{background:var(--card);border-radius:.3rem;padding:.55rem .8rem}
.cards dt{color:var(--soft);font-size:.82rem}.cards dd{margin:0;font-size:1.12rem;font-variant-numeric:tabular-nums}
.cards dd small{display:block;font-size:.78rem;color:var(--soft)}
.pair{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,28rem),1fr));gap:1rem 1.6rem}
.pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,28rem),1fr));gap:1rem}
figure{margin:0;min-width:0}img,video,svg{display:block;width:100%;height:auto}
img,video{background:#fff;border-radius:.3rem;border:1px solid var(--line)}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums;font-size:.93rem}
th{font-weight:600;color:var(--soft);font-size:.84rem}
td,th{padding:.28rem .6rem;border-bottom:1px solid var(--line);text-align:right;white-space:nowrap;vertical-align:top}
td:first-child,th:first-child{text-align:left;padding-left:0}
table.text td,table.text th{text-align:left;white-space:normal;overflow-wrap:anywhere}table.text td:first-child{white-space:nowrap;padding-right:1.2rem}
tr.sum td{font-weight:600;border-bottom:none}
.bar{display:inline-block;height:.62rem;background:var(--c0);border-radius:.1rem;min-width:1px;vertical-align:middle}
td.bars{width:22%;min-width:5rem;text-align:left}
.tag{display:inline-block;min-width:2.3rem;text-align:center;border-radius:.25rem;font-size:.8rem;padding:0 .35rem;border:1px solid var(--line);color:var(--soft)}
.tag.on{background:var(--good);border-color:var(--good);color:var(--ground)}
pre{background:var(--card);padding:.8rem 1rem;border-radius:.3rem;overflow-x:auto;font:.82rem/1.5 ui-monospace,"DejaVu Sans Mono",monospace;margin:0}
details>summary{cursor:pointer;color:var(--soft);margin-bottom:.6rem}
svg text{font-size:12.5px;fill:var(--soft)}svg .grid{stroke:var(--line);stroke-width:1}svg .axis{stroke:var(--soft);stroke-width:1}
svg .roof{stroke:var(--ink);stroke-width:2;fill:none}svg .strong{fill:var(--ink)}
svg .k0{stroke:var(--c0)}svg .k1{stroke:var(--c1)}svg .k2{stroke:var(--c2)}svg .k3{stroke:var(--c3)}svg .k4{stroke:var(--c4)}svg .k5{stroke:var(--c5)}svg .k6{stroke:var(--c6)}
.s0{color:var(--c0)}.s1{color:var(--c1)}.s2{color:var(--c2)}.s3{color:var(--c3)}.s4{color:var(--c4)}.s5{color:var(--c5)}.s6{color:var(--c6)}
svg .d0{fill:var(--c0)}svg .d1{fill:var(--c1)}svg .d2{fill:var(--c2)}svg .d3{fill:var(--c3)}svg .d4{fill:var(--c4)}svg .d5{fill:var(--c5)}svg .d6{fill:var(--c6)}
.legend{display:flex;flex-wrap:wrap;gap:.1rem .9rem;font-size:.84rem;color:var(--soft);margin:.2rem 0 0;padding:0;list-style:none}
@media (max-width:34rem){main{padding:1rem .8rem 2rem}h1{font-size:1.3rem}table{font-size:.86rem}td,th{padding:.25rem .4rem}}
@media print{:root{color-scheme:light;--ground:#fff;--card:#f5f6f8;--ink:#000;--soft:#444;--line:#bbb;--good:#1a7f45;--warn:#9a5b00;--bad:#b3261e;
--c0:#4477aa;--c1:#ee6677;--c2:#228833;--c3:#b8970c;--c4:#2a9fc4;--c5:#aa3377;--c6:#777}
main{max-width:none;padding:0}body{font-size:11pt}figure,.verdict,.cards,tr{break-inside:avoid}h2{break-after:avoid}
.bar,.verdict,.cards div,.tag.on,svg{print-color-adjust:exact;-webkit-print-color-adjust:exact}
pre{white-space:pre-wrap;overflow:visible}details>summary,video,section:has(>details:not([open])){display:none}hr{break-after:page;visibility:hidden}.pictures{grid-template-columns:1fr 1fr}}
)css";
} // namespace

namespace {
void escape(std::string_view s, std::string& out)
{
    for (const char c : s) switch (c) {
        case '&':
            out += "&amp;";
            break;
        case '<':
            out += "&lt;";
            break;
        case '>':
            out += "&gt;";
            break;
        case '"':
            out += "&quot;";
            break;
        case '\'':
            out += "&#39;";
            break;
        default:
            // Pages have no other control characters.
            if ((unsigned char)(c) < 0x20 && c != '\n' && c != '\t') out += "\ufffd";
            else out += c;
        }
}
} // namespace

std::string escaped(std::string_view s)
{
    std::string out;
    for (auto bad = io::malformed(s); bad != s.npos; bad = io::malformed(s)) { // a page is UTF-8
        escape(s.substr(0, bad), out), out += "\ufffd";
        s.remove_prefix(bad + 1);
    }
    escape(s, out);
    return out;
}

std::string data_uri(std::string_view mime_type, std::string_view in)
{
    static const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out = "data:" + std::string(mime_type) + ";base64,";
    out.reserve(out.size() + in.size() * 4 / 3 + 4);
    for (std::size_t i = 0; i < in.size(); i += 3) {
        const std::size_t n = std::min<std::size_t>(3, in.size() - i);
        std::uint32_t v = 0;
        for (std::size_t k = 0; k < 3; ++k) v = v << 8 | (k < n ? std::uint8_t(in[i + k]) : 0);
        for (std::size_t k = 0; k < 4; ++k) out += k <= n ? digits[v >> (18 - 6 * k) & 63] : '=';
    }
    return out;
}

std::string section(const char* id, const char* title, const std::string& body)
{
    return body.empty() ? std::string() : fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n{}</section>\n", id, title, body);
}

std::string card(const char* name, const std::string& value, const std::string& more)
{
    return fmt::format("<div><dt>{}</dt><dd>{}{}</dd></div>", name, escaped(value),
                       more.empty() ? "" : "<small>" + escaped(more) + "</small>");
}

std::string page(std::string_view title, std::string_view body)
{
    return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
           "content=\"width=device-width,initial-scale=1\">\n<title>" +
           escaped(title) + "</title>\n<style>" + style + "</style>\n</head>\n<body>\n<main>\n" + std::string(body) +
           "</main>\n</body>\n</html>\n";
}

} // namespace kuzure::report
