#include "report/page.hpp"

#ifdef VSTENT_REPORT_PAGE

asm(".section .rodata\n"
    ".global vstent_report_page\n"
    "vstent_report_page:\n"
    ".incbin \"" VSTENT_REPORT_PAGE
    "\"\n"
    ".global vstent_report_page_end\n"
    "vstent_report_page_end:\n"
    ".byte 0\n"
    ".previous\n");
extern "C" const char vstent_report_page[], vstent_report_page_end[];

namespace vstent::report {

std::string_view page() {
  return {vstent_report_page,
          static_cast<std::size_t>(vstent_report_page_end - vstent_report_page)};
}

}  // namespace vstent::report

#else

namespace vstent::report {

std::string_view page() { return {}; }

}  // namespace vstent::report

#endif
