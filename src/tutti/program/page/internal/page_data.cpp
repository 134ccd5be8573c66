// SPDX-License-Identifier: BSD-3-Clause
// A library of its own: ccache does not keep what has a file in it.
#include "tutti/program/page/internal/page_data.hpp"

// The file web/dist/index.html, byte by byte: the linker's symbols around it.
__asm__(
    ".section .rodata\n"
    ".global tutti_page_begin\n"
    ".global tutti_page_end\n"
    "tutti_page_begin:\n"
    ".incbin \"" TUTTI_PAGE_FILE
    "\"\n"
    "tutti_page_end:\n"
    ".byte 0\n"
    ".text\n");
extern "C" {
extern const char tutti_page_begin[];
extern const char tutti_page_end[];
}

namespace tutti::page {

std::string_view live_page() { return {tutti_page_begin, static_cast<std::size_t>(tutti_page_end - tutti_page_begin)}; }

}  // namespace tutti::page
