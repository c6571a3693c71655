// The tests of Osp.cs: Test.exe bindings/conformance.txt
using System;
using System.Threading;
using OspCulling;

static class Test
{
    static readonly float[] Identity = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
    /// <summary>A camera that looks along -z, with the depth of OpenGL.</summary>
    static readonly float[] Ahead = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1.002002f, -1, 0, 0, -0.2002002f, 0 };
    static readonly OspBox Unit = new OspBox(0, 0, 0, 1, 1, 1);

    static int Main(string[] arguments)
    {
        if (arguments.Length != 1)
        {
            Console.Error.WriteLine("usage: Test.exe conformance.txt");
            return 2;
        }
        Expect(Osp.LibraryVersion == Osp.Version, "the version of the library");
        int answers = Cases.Run(arguments[0]);
        Expect(answers > 150, answers + " answers");
        Errors();
        Refusals();
        Occlusion();
        Threads();
        Lifetimes();
        Console.WriteLine(answers + " answers as expected; errors, occlusion, threads and lifetimes passed");
        return 0;
    }

    public static void Expect(bool holds, string what)
    {
        if (!holds)
        {
            throw new Exception("expected " + what);
        }
    }

    public static void Refused(OspStatus status, Action call)
    {
        try
        {
            call();
        }
        catch (OspException e)
        {
            Expect(e.Status == status && e.Message.Length > 0, status + ", found " + e.Status + ": " + e.Message);
            return;
        }
        throw new Exception("expected " + status + ", found no error");
    }

    static void Throws<T>(Action call) where T : Exception
    {
        try
        {
            call();
        }
        catch (T)
        {
            return;
        }
        throw new Exception("expected " + typeof(T).Name);
    }

    static void Errors()
    {
        Throws<ArgumentException>(() => new OspCamera(new float[15], OspDepth.ZeroToOne));
        Refused(OspStatus.InvalidCamera, () => new OspCamera(new float[16], OspDepth.ZeroToOne));
        Refused(OspStatus.InvalidCamera, () => new OspCamera(new double[16], OspDepth.ZeroToOne));
        Refused(OspStatus.InvalidArgument, () => new OspCamera(Identity, (OspDepth)7));
        using (var culler = new OspCuller())
        {
            ulong[] keys = { 1, ulong.MaxValue, 3 }, room = new ulong[4];
            int count;
            OspBox[] boxes = { Unit, Unit, Unit };
            Throws<ArgumentException>(() => culler.Set(keys, new OspBox[2]));
            culler.Set(keys, boxes);
            culler.Set(new ulong[0], new OspBox[0]);
            culler.Set(default(ReadOnlySpan<ulong>), default(ReadOnlySpan<OspBox>));
            Expect(culler.Count == 3, "three objects");
            Refused(OspStatus.UnknownKey, () => culler.Box(2));
            culler.Remove(2);
            Throws<ArgumentException>(() => culler.SetOccluderQuad(1, new float[11]));
            Throws<ArgumentException>(() => culler.SetOccluderMesh(1, new float[8], new uint[3]));
            Throws<ArgumentException>(() => culler.SetOccluderMesh(1, new float[9], new uint[4]));
            Refused(OspStatus.InvalidOccluder, () => culler.SetOccluderQuad(1, new float[12]));
            Refused(OspStatus.InvalidOccluder, () => culler.SetOccluderMesh(1, new float[9], new uint[] { 0, 1, 3 }));
            Refused(OspStatus.InvalidOccluder, () => culler.SetOccluderBox(1, new OspBox(1, 1, 1, 0, 0, 0)));
            Refused(OspStatus.InvalidArgument, () => culler.Visible(0, room, out count));
            var camera = new OspCamera(Identity, OspDepth.ZeroToOne);
            Throws<ArgumentException>(() => culler.Cull(new[] { camera, camera }, new OspSeen[1]));
            culler.Cull(new[] { camera, camera }, default(Span<OspSeen>));
            Expect(culler.Cull(camera).Visible == 3, "three in view");
            Refused(OspStatus.InvalidArgument, () => culler.Visible(1, room, out count));
            Refused(OspStatus.InvalidArgument, () => culler.Visible(-1, room, out count));
            Expect(!culler.Visible(0, room.AsSpan(0, 2), out count) && count == 3, "too little room");
            Refused(OspStatus.InvalidArgument, () => culler.InSphere(0, 0, 0, -1, room, out count));
            Refused(OspStatus.InvalidArgument, () => culler.OnRay(new float[3], new float[3], 1, new OspHit[1]));
            culler.Remove(new ulong[] { 1, 3 });
            culler.Commit();
            Expect(culler.InBox(Unit, room, out count) && count == 1 && room[0] == ulong.MaxValue, "the one that stayed");
            var near = new OspHit[3];
            Refused(OspStatus.InvalidArgument, () => culler.Nearest(0, float.NaN, 0, near));
            Expect(culler.Nearest(0, 3, 0, near) == 1 && near[0].Key == ulong.MaxValue && near[0].T == 2, "the nearest");
            culler.Clear();
            Expect(culler.Count == 0, "nothing");
        }
        float[] origin = new float[3], direction = new float[3];
        new OspCamera(Ahead, OspDepth.MinusOneToOne).Ray(0, 0, origin, direction);
        Expect(Math.Abs(origin[2] + 0.1f) < 1e-5f && direction[2] == -1, "a ray along the view");
    }

    static void Refusals()
    {
        using (var culler = new OspCuller())
        {
            foreach (float bad in new[] { float.NaN, float.PositiveInfinity, 2 })
            {
                OspBox box = Unit;
                box.MinY = bad;
                culler.Set(new ulong[] { 4, 5, 6 }, new[] { Unit, box, Unit });
                culler.Cull(new OspCamera(Identity, OspDepth.ZeroToOne));
                OspRefused[] refused = culler.Refused();
                Expect(refused.Length == 1 && refused[0].Key == 5 && refused[0].Why == OspRefusal.Bounds, "the invalid box");
                Expect(culler.Count == 2, "the others");
            }
            culler.Cull(new OspCamera(Identity, OspDepth.ZeroToOne));
            Expect(culler.Refused().Length == 0, "each once");
        }
    }

    static void Occlusion()
    {
        float[] corners = { -1.9f, -1.9f, -2, 1.9f, -1.9f, -2, 1.9f, 1.9f, -2, -1.9f, 1.9f, -2 };
        const ulong Wall = 1000;
        var occluders = new Action<OspCuller>[] {
            culler => culler.SetOccluderQuad(Wall, corners),
            culler => culler.SetOccluderMesh(Wall, corners, new uint[] { 0, 1, 2, 0, 2, 3 }),
            culler => culler.SetOccluderBox(Wall, new OspBox(-1.9f, -1.9f, -3, 1.9f, 1.9f, -2)) };
        foreach (Action<OspCuller> occlude in occluders)
        {
            using (var culler = new OspCuller())
            {
                for (int i = 0; i < 100; i++)
                {
                    float x = i % 10 * 0.2f - 1, y = i / 10 * 0.2f - 1;
                    culler.Set((ulong)i, new OspBox(x, y, -6, x + 0.1f, y + 0.1f, -5.9f));
                }
                occlude(culler);
                ulong[] visible = null;
                var eye = new OspCamera(Ahead, OspDepth.MinusOneToOne);
                Expect(culler.Cull(eye).Visible == 100, "what is not to be hidden");
                eye.HideByOccluders = true;
                OspSeen seen = culler.Cull(eye);
                Expect(seen.Visible == 0 && seen.Hidden == 100, "nothing behind the wall");
                var hidden = new bool[2];
                culler.AreHidden(eye, new[] { new OspBox(-1, -1, -7, 1, 1, -6), new OspBox(-1, -1, -1.5f, 1, 1, -1) }, hidden);
                Expect(hidden[0] && !hidden[1], "a box behind the wall, and one before it");
                Throws<ArgumentException>(() => culler.AreHidden(eye, new OspBox[1], hidden));
                culler.SetLayers(7, 2);
                eye.Layers = 2;
                Expect(culler.Cull(eye).Visible == 1, "a camera without the wall's layer");
                Expect(culler.Visible(0, ref visible) == 1 && visible[0] == 7, "the one on its layer");
                culler.RemoveOccluder(Wall);
                eye.Layers = Osp.AllLayers;
                Expect(culler.Cull(eye).Visible == 100, "all that it hid");
            }
        }
    }

    static void Threads()
    {
        using (var culler = new OspCuller())
        {
            for (int i = 0; i < 100; i++)
            {
                culler.Set((ulong)i, new OspBox(0, 0, -5, i * 0.01f, 1, -4));
            }
            culler.Cull(new OspCamera(Ahead, OspDepth.MinusOneToOne));
            int wrong = 0;
            var threads = new Thread[3];
            for (int i = 0; i < threads.Length; i++)
            {
                threads[i] = new Thread(() =>
                {
                    ulong[] keys = null;
                    for (int k = 0; k < 200; k++)
                    {
                        if (culler.Visible(0, ref keys) != 100)
                        {
                            Interlocked.Increment(ref wrong);
                        }
                    }
                });
                threads[i].Start();
            }
            foreach (Thread thread in threads)
            {
                thread.Join();
            }
            Expect(wrong == 0, "the same answer on every thread");
        }
    }

    static void Lifetimes()
    {
        var culler = new OspCuller();
        culler.Dispose();
        culler.Dispose();
        Throws<ObjectDisposedException>(() => culler.Set(1, Unit));
        // The finalizer frees these cullers.
        for (int i = 0; i < 50; i++)
        {
            new OspCuller().Set(1, Unit);
        }
        GC.Collect();
        GC.WaitForPendingFinalizers();
    }
}
