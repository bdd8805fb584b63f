#include "io/canvas.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdlib>
#include <fmt/format.h>
#include <mutex>
#include <numbers>
#include <png.h>
#if KUZURE_PICTURES
#include <pango/pangocairo.h>
#endif

namespace kuzure::io {

Canvas::Canvas(int width, int height, Rgb background) : width_(width), height_(height)
{
    if (!can_draw())
        throw BadInput("this kuzure was built without Cairo and Pango and draws no pictures. Remedy: build it where they are "
                       "(jobs/install.sh), or draw there from this run's snapshots: kuzure picture DIR");
    pixels_.assign(std::size_t(width) * std::size_t(height),
                   0xff000000u | std::uint32_t(background.r) << 16 | std::uint32_t(background.g) << 8 | std::uint32_t(background.b));
}

#if KUZURE_PICTURES
namespace {

// One map of fonts for the program: finding the fonts takes longer than drawing. Pango's objects are not for several threads at once.
std::mutex pango;

template <class T, void (*close)(T*)> struct Closer {
    void operator()(T* t) const { close(t); }
};
using Surface = std::unique_ptr<cairo_surface_t, Closer<cairo_surface_t, cairo_surface_destroy>>;
using Pen = std::unique_ptr<cairo_t, Closer<cairo_t, cairo_destroy>>;
struct Unref {
    void operator()(void* object) const { g_object_unref(object); }
};
using Layout = std::unique_ptr<PangoLayout, Unref>;

struct Drawing {
    Surface surface;
    Pen pen;
    Drawing(std::uint32_t* pixels, int width, int height)
        : surface(
              cairo_image_surface_create_for_data(reinterpret_cast<unsigned char*>(pixels), CAIRO_FORMAT_RGB24, width, height, 4 * width)),
          pen(cairo_create(surface.get()))
    {
    }
    operator cairo_t*() const { return pen.get(); }
    void color(Rgb c) const { cairo_set_source_rgb(pen.get(), c.r / 255.0, c.g / 255.0, c.b / 255.0); }
};

/// A line of text laid out, whatever the settings of the desk it is drawn at. The lock is held.
Layout laid_out(double size, const std::string& text)
{
    static PangoFontMap* const fonts = pango_cairo_font_map_new();
    static PangoContext* const context = [] {
        PangoContext* c = pango_font_map_create_context(fonts);
        cairo_font_options_t* options = cairo_font_options_create();
        cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
        cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_SLIGHT);
        cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
        pango_cairo_context_set_font_options(c, options);
        cairo_font_options_destroy(options);
        pango_cairo_context_set_resolution(c, 72);
        return c;
    }();
    // Han letters have one code and several shapes, and nothing in a text says which are meant. Numbers look the same beside any title.
    const bool ascii = std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 128; });
    const char* locale = std::getenv("LANG");
    const std::string_view spoken = locale ? locale : "";
    const char* language = ascii ? "en" : spoken.starts_with("zh") ? "zh" : spoken.starts_with("ko") ? "ko" : "ja";
    pango_context_set_language(context, pango_language_from_string(language));
    Layout layout(pango_layout_new(context));
    PangoFontDescription* font = pango_font_description_from_string("sans-serif");
    pango_font_description_set_absolute_size(font, size * PANGO_SCALE);
    pango_layout_set_font_description(layout.get(), font);
    pango_font_description_free(font);
    pango_layout_set_single_paragraph_mode(layout.get(), true);
    pango_layout_set_text(layout.get(), text.data(), int(text.size()));
    return layout;
}

bool known(const std::string& text) { return pango_layout_get_unknown_glyphs_count(laid_out(16, text).get()) == 0; }

/// Valid UTF-8, without control characters: Pango accepts nothing else.
std::string printable(const std::string& text)
{
    gchar* valid = g_utf8_make_valid(text.data(), gssize(text.size()));
    std::string s = valid;
    g_free(valid);
    for (char& c : s)
        if (static_cast<unsigned char>(c) < 32 || c == 127) c = ' ';
    return s;
}

template <class F> void for_each_letter(const std::string& text, F f)
{
    for (const char *at = text.c_str(), *next; *at; at = next) next = g_utf8_next_char(at), f(std::string(at, next));
}

/// The text with a box for every letter without a font. Pango would show the code in a box, too small to read. The lock is held.
std::string with_boxes(const std::string& given)
{
    const std::string text = printable(given);
    if (known(text)) return text;
    const std::string box = known("\u25a1") ? "\u25a1" : "?";
    std::string out;
    for_each_letter(text, [&](const std::string& letter) { out += known(letter) ? letter : box; });
    return out;
}

} // namespace

bool can_draw() { return true; }

void Canvas::rectangle(double x, double y, double width, double height, Rgb c)
{
    const Drawing d(pixels_.data(), width_, height_);
    d.color(c);
    cairo_rectangle(d, x, y, width, height);
    cairo_fill(d);
}

void Canvas::line(double x0, double y0, double x1, double y1, double thickness, Rgb c)
{
    const Drawing d(pixels_.data(), width_, height_);
    d.color(c);
    cairo_set_line_width(d, thickness);
    cairo_move_to(d, x0, y0);
    cairo_line_to(d, x1, y1);
    cairo_stroke(d);
}

void Canvas::ring(double x, double y, double radius, double thickness, Rgb c)
{
    const Drawing d(pixels_.data(), width_, height_);
    d.color(c);
    cairo_set_line_width(d, thickness);
    cairo_arc(d, x, y, radius, 0, 2 * std::numbers::pi);
    cairo_stroke(d);
}

void Canvas::triangle(std::array<std::array<double, 2>, 3> corners, Rgb c)
{
    const Drawing d(pixels_.data(), width_, height_);
    d.color(c);
    for (const auto& p : corners) cairo_line_to(d, p[0], p[1]);
    cairo_close_path(d);
    cairo_fill(d);
}

double Canvas::text_width(double size, const std::string& text)
{
    const std::lock_guard lock(pango);
    PangoRectangle box;
    pango_layout_get_extents(laid_out(size, with_boxes(text)).get(), nullptr, &box);
    return double(box.width) / PANGO_SCALE;
}

std::string Canvas::letters_missing(const std::string& given)
{
    const std::lock_guard lock(pango);
    const std::string text = printable(given);
    std::string missing;
    if (known(text)) return missing;
    for_each_letter(text, [&](const std::string& letter) {
        if (!known(letter) && missing.find(letter) == std::string::npos) missing += letter;
    });
    return missing;
}

void Canvas::text(double x, double y, double size, const std::string& text, Rgb c, Anchor anchor, double most, bool upright)
{
    const std::lock_guard lock(pango);
    const Layout layout = laid_out(size, with_boxes(text));
    PangoRectangle box;
    pango_layout_get_extents(layout.get(), nullptr, &box);
    if (most > 0 && double(box.width) / PANGO_SCALE > most) {
        pango_layout_set_ellipsize(layout.get(), PANGO_ELLIPSIZE_END);
        pango_layout_set_width(layout.get(), int(most * PANGO_SCALE));
        pango_layout_get_extents(layout.get(), nullptr, &box);
    }
    const double width = double(box.width) / PANGO_SCALE, height = double(box.height) / PANGO_SCALE;
    const double back = anchor == Anchor::Left ? 0 : anchor == Anchor::Middle ? 0.5 * width : width;
    const Drawing d(pixels_.data(), width_, height_);
    cairo_translate(d, x, y);
    if (upright) cairo_rotate(d, -0.5 * std::numbers::pi);
    cairo_move_to(d, -back, -0.5 * height);
    pango_cairo_layout_path(d, layout.get());
    cairo_set_line_join(d, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_width(d, 3);
    d.color({255, 255, 255});
    cairo_stroke(d);
    cairo_move_to(d, -back, -0.5 * height);
    d.color(c);
    pango_cairo_show_layout(d, layout.get());
}

#else

bool can_draw() { return false; }
void Canvas::rectangle(double, double, double, double, Rgb) {}
void Canvas::line(double, double, double, double, double, Rgb) {}
void Canvas::ring(double, double, double, double, Rgb) {}
void Canvas::triangle(std::array<std::array<double, 2>, 3>, Rgb) {}
void Canvas::text(double, double, double, const std::string&, Rgb, Anchor, double, bool) {}
double Canvas::text_width(double, const std::string&) { return 0; }
std::string Canvas::letters_missing(const std::string&) { return {}; }

#endif

// ---- few colours -----------------------------------------------------------------------------------------------------------
Palette::Palette(std::vector<Rgb> colors) : colors_(std::move(colors)), nearest_(32 * 32 * 32)
{
    ensure(!colors_.empty() && colors_.size() <= 256, "a palette has 1 to 256 colours");
    std::vector<int> red, green, blue;
    for (const Rgb c : colors_) red.push_back(c.r), green.push_back(c.g), blue.push_back(c.b);
    const int n = int(colors_.size());
#pragma omp parallel for schedule(static)
    for (int code = 0; code < int(nearest_.size()); ++code) {
        // The ends of five bits stand for black and white.
        const int r = (code >> 10) * 255 / 31, g = (code >> 5 & 31) * 255 / 31, b = (code & 31) * 255 / 31;
        int best = 1 << 30; // the distance as eyes weigh it, at most 585,225, above the number
        for (int k = 0; k < n; ++k) {
            const int dr = r - red[std::size_t(k)], dg = g - green[std::size_t(k)], db = b - blue[std::size_t(k)];
            best = std::min(best, (2 * dr * dr + 4 * dg * dg + 3 * db * db) << 8 | k);
        }
        nearest_[std::size_t(code)] = std::uint8_t(best & 255);
    }
}

void Reduced::take(const Canvas& canvas, const Palette& palette, Area a)
{
    ensure(canvas.width() == width && canvas.height() == height, "two pictures of different sizes");
    const int x0 = std::max(a.x, 0), x1 = std::min(a.x + a.width, width), y1 = std::min(a.y + a.height, height);
    for (int y = std::max(a.y, 0); y < y1; ++y) {
        const std::uint32_t* from = canvas.row(y);
        std::uint8_t* to = &index[std::size_t(y) * std::size_t(width)];
        for (int x = x0; x < x1; ++x) to[x] = palette.nearest(from[x]);
    }
}

Reduced reduce(const Canvas& canvas, const Palette& palette)
{
    Reduced r{canvas.width(), canvas.height(), std::vector<std::uint8_t>(std::size_t(canvas.width()) * std::size_t(canvas.height()))};
    r.take(canvas, palette, {0, 0, r.width, r.height});
    return r;
}

std::string png(const Reduced& picture, const Palette& palette)
{
    std::string out, trouble;
    out.reserve(picture.index.size() / 8);
    const auto failed = [](png_structp p, png_const_charp why) {
        *static_cast<std::string*>(png_get_error_ptr(p)) = why;
        png_longjmp(p, 1);
    };
    png_structp write = png_create_write_struct(PNG_LIBPNG_VER_STRING, &trouble, failed, [](png_structp, png_const_charp) {});
    png_infop info = write ? png_create_info_struct(write) : nullptr;
    std::vector<png_color> colors;
    for (const Rgb c : palette.colors()) colors.push_back({c.r, c.g, c.b});
    if (!info || setjmp(png_jmpbuf(write))) {
        png_destroy_write_struct(&write, &info);
        throw IoFailed(fmt::format("making a PNG picture failed: {}", trouble.empty() ? "no memory" : trouble));
    }
    png_set_write_fn(
        write, &out,
        [](png_structp p, png_bytep data, std::size_t n) {
            static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<const char*>(data), n);
        },
        [](png_structp) {});
    png_set_IHDR(write, info, png_uint_32(picture.width), png_uint_32(picture.height), 8, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_PLTE(write, info, colors.data(), int(colors.size()));
    png_set_filter(write, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
    png_set_compression_level(write, 1);
    png_set_compression_buffer_size(write, 1 << 18);
    png_write_info(write, info);
    for (int y = 0; y < picture.height; ++y) png_write_row(write, &picture.index[std::size_t(y) * std::size_t(picture.width)]);
    png_write_end(write, info);
    png_destroy_write_struct(&write, &info);
    return out;
}

} // namespace kuzure::io
