#if KUZURE_TERRAIN
#include "io/ground/tiff_library.hpp"
#include <cstdarg>
#include <cstdio>
#include <mutex>

namespace kuzure::io::ground {
namespace {

void keep_words(const char*, const char* format, std::va_list arguments)
{
    char text[400];
    std::vsnprintf(text, sizeof text, format, arguments);
    last_words() = text;
}

void keep_words_on_keys(gtiff*, int, const char* format, ...)
{
    std::va_list arguments;
    va_start(arguments, format);
    keep_words("", format, arguments);
    va_end(arguments);
}

} // namespace

GeoKeys geo_keys(TIFF* tiff) { return GeoKeys(GTIFNewEx(tiff, keep_words_on_keys, nullptr)); }

std::string& last_words()
{
    static thread_local std::string words;
    return words;
}

void set_up_libtiff()
{
    static std::once_flag once;
    std::call_once(once, [] {
        TIFFSetErrorHandler(keep_words);
        TIFFSetWarningHandler(nullptr);
        XTIFFInitialize();
        static TIFFExtendProc parent;
        parent = TIFFSetTagExtender([](TIFF* tiff) {
            static const TIFFFieldInfo fields[] = {
                {gdal_metadata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GDALMetadata")},
                {gdal_nodata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GDALNoDataValue")}};
            TIFFMergeFieldInfo(tiff, fields, 2);
            if (parent) parent(tiff);
        });
    });
}

} // namespace kuzure::io::ground
#endif
