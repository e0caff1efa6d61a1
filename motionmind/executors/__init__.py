"""Workers to hand jobs to: this process, others on this machine, or a cluster, by one `concurrent.futures.Executor`."""
