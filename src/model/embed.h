#pragma once
// Files that a library or program contains. FILES is made by bielle_embed() (cmake/layers.cmake): BIELLE_FILE(identifier, name, path) for
// each. To be included first with BIELLE_FILE as BIELLE_EMBED, then as BIELLE_ENTRY in the list of a map from names to texts.
// The assembler copies each file between two symbols.
#define BIELLE_EMBED(id, name, path)                                                        \
  __asm__(                                                                                  \
      ".section .rodata\n"                                                                  \
      ".global bielle_asset_" #id "_begin\nbielle_asset_" #id "_begin:\n.incbin \"" path    \
      "\"\n"                                                                                \
      ".global bielle_asset_" #id "_end\nbielle_asset_" #id "_end:\n.byte 0\n.previous\n"); \
  extern "C" const char bielle_asset_##id##_begin[], bielle_asset_##id##_end[];
#define BIELLE_ENTRY(id, name, path) {name, {bielle_asset_##id##_begin, bielle_asset_##id##_end}},
