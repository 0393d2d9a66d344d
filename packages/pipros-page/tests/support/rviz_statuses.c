/* Writes each change of a display's status in genuine rviz to the file in RVIZ_STATUSES: tab-separated lines
 * "set", display, level, name, text; "delete", display, name; "clear", display. It is loaded with LD_PRELOAD, calls the
 * functions of librviz that it replaces, and needs no headers of Qt or rviz. Built by script/generate rviz. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/* The beginning of a QString's data in Qt 5: UTF-16 at an offset from here. */
struct text {
  int references, size;
  unsigned int capacity;
  ptrdiff_t offset;
};

static FILE *output(void) {
  static FILE *file;
  if (!file) file = fopen(getenv("RVIZ_STATUSES"), "w");
  return file;
}

static void put(const struct text *text) {
  const uint16_t *units = (const uint16_t *)((const char *)text + text->offset);
  fputc('\t', output());
  for (int i = 0; i < text->size; i++) {
    uint16_t unit = units[i] == '\n' || units[i] == '\t' ? ' ' : units[i];
    fputc(unit < 128 ? unit : '?', output());
  }
}

/* Property::getName() returns a QString, through memory of the caller. It is not freed: it lives as long as rviz. */
static void begin(const char *what, void *display) {
  typedef void (*get_name)(const struct text **, const void *);
  const struct text *name;
  ((get_name)dlsym(RTLD_DEFAULT, "_ZNK4rviz8Property7getNameEv"))(&name, display);
  fputs(what, output());
  put(name);
}

static void end(void) {
  fputc('\n', output());
  fflush(output());
}

#define SET _ZN4rviz7Display9setStatusENS_14StatusProperty5LevelERK7QStringS5_
#define DELETE _ZN4rviz7Display12deleteStatusERK7QString
#define CLEAR _ZN4rviz7Display13clearStatusesEv
#define STRING(name) #name
#define NEXT(name) dlsym(RTLD_NEXT, STRING(name))

void SET(void *display, int level, const struct text **name, const struct text **text) {
  flockfile(output());
  begin("set", display);
  fprintf(output(), "\t%d", level);
  put(*name);
  put(*text);
  end();
  funlockfile(output());
  ((void (*)(void *, int, const struct text **, const struct text **))NEXT(SET))(display, level, name, text);
}

void DELETE(void *display, const struct text **name) {
  flockfile(output());
  begin("delete", display);
  put(*name);
  end();
  funlockfile(output());
  ((void (*)(void *, const struct text **))NEXT(DELETE))(display, name);
}

void CLEAR(void *display) {
  flockfile(output());
  begin("clear", display);
  end();
  funlockfile(output());
  ((void (*)(void *))NEXT(CLEAR))(display);
}
