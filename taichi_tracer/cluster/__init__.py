"""Pictures on more than one machine, by Dask: sample ranges go out, and sums come back; docs/cluster.md."""
