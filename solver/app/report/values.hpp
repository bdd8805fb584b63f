#pragma once
// What a record holds, as numbers and words of the page: a value that is not there or is none becomes a dash or an empty text.
#include "solver/app/report/chart.hpp"
#include "solver/app/report/record.hpp"
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace kuzure::report {

using Json = nlohmann::json;

/// "3 min 20 s", from seconds.
std::string duration(double seconds);
/// Digits in groups of three, narrow spaces between.
std::string grouped(double n);
/// Seconds with three digits behind the point, or a dash.
std::string fixed(double seconds);

/// The number at the end of a path of keys; no number where there is none.
double at(const Json&, std::initializer_list<const char*> path);
/// The string of a key, or nothing.
std::string word(const Json&, const char* key);
/// Strings of an array, if it is one.
std::vector<std::string> strings(const Json&, const char* key);

/// Of numbers that may not be there, which are no error: x > y, or no.
bool more(double x, double y);
/// a/b, or no number.
double ratio(double a, double b);

/// A column of a table, empty where there is none.
std::span<const double> column(const Table&, const char* name);
/// Its last number, or no number.
double last(const Table&, const char* name);
/// Curves of those columns that exist.
std::vector<Curve> curves(const Table&, std::initializer_list<std::pair<const char*, const char*>> wanted);

} // namespace kuzure::report
