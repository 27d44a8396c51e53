"""Stages of the backward flow: recordings -> dwells -> fit; each file takes a record and gives a record."""
