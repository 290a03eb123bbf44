/* What a system does in its own way with each value that comes. */
#ifndef OWN_H
#define OWN_H

int assign(Instance *instance, uint32_t reference, double value);
int awaits_preview(const Instance *instance);

#endif
