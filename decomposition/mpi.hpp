#pragma once
// For the .cpp files of decomposition/ only: MPI itself, its errors as exceptions, and the tags in use.
#include "decomposition/comm.hpp"
#include <mpi.h>
#include <string>

namespace kuzure::mpi {

/// exchange() alternates between the first two; the others are point to point.
enum Tag { Even = 0, Odd = 1, Gather = 2, Refresh = 3, Scalar = 4 };

inline void check(int code, const char* call)
{
    if (code == MPI_SUCCESS) return;
    char text[MPI_MAX_ERROR_STRING];
    int n = 0;
    MPI_Error_string(code, text, &n);
    throw MpiFailed(std::string(call) + " failed: " + std::string(text, std::size_t(n)));
}

/// Owns a committed datatype.
struct Type {
    MPI_Datatype type = MPI_DATATYPE_NULL;
    Type() = default;
    Type(Type&& other) noexcept : type(other.type) { other.type = MPI_DATATYPE_NULL; }
    Type& operator=(Type&& other) noexcept
    {
        std::swap(type, other.type);
        return *this;
    }
    ~Type()
    {
        if (type != MPI_DATATYPE_NULL) MPI_Type_free(&type);
    }
};
/// `bytes` contiguous bytes as one item.
inline Type item_of(std::size_t bytes)
{
    ensure(bytes <= Comm::largest_piece, "an item of more than 1 GiB");
    Type t;
    check(MPI_Type_contiguous(int(bytes), MPI_BYTE, &t.type), "MPI_Type_contiguous");
    check(MPI_Type_commit(&t.type), "MPI_Type_commit");
    return t;
}

} // namespace kuzure::mpi
