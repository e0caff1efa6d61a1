"""Workers for jobs: this process, others on this machine, or a cluster, each as a `concurrent.futures.Executor`."""
