/* SHA-256 (FIPS 180-4), for naming what a plan was made from. Not for secrets. */
#ifndef MORPH_SHA256_H
#define MORPH_SHA256_H

#include <stddef.h>
#include <stdint.h>

typedef struct morph_sha256 {
    uint32_t state[8];
    uint64_t bytes; /* seen so far */
    unsigned char block[64];
} morph_sha256;

void morph_sha256_begin(morph_sha256 *hash);
void morph_sha256_add(morph_sha256 *hash, const void *data, size_t size); /* data may be NULL if size is 0 */
/* 64 lower-case hexadecimal digits and a 0. The hash must be begun anew afterwards. */
void morph_sha256_end(morph_sha256 *hash, char text[65]);

/* All of it for one array. */
void morph_sha256_text(const void *data, size_t size, char text[65]);

#endif
