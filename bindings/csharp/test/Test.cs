// The tests of Osp.cs: Test.exe bindings/conformance.txt
using System;
using System.Threading;
using OspCulling;

static class Test
{
    static readonly float[] Identity = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
    /// <summary>Looking along -z, depth as OpenGL has it.</summary>
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
        IndexErrors();
        SceneErrors();
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

    static void IndexErrors()
    {
        Refused(OspStatus.InvalidArgument, () => new OspIndex(new OspIndexConfig { RootSize = 0 }));
        Refused(OspStatus.InvalidArgument, () => new OspIndex(new OspIndexConfig { RootSize = float.NaN }));
        Refused(OspStatus.InvalidArgument, () => new OspIndex(new OspIndexConfig { RootSize = 1, Capacity = uint.MaxValue }));
        using (var index = new OspIndex(new OspIndexConfig { RootSize = 8, Capacity = 100 }))
        {
            uint[] ids = new uint[3], room = new uint[4];
            int count;
            OspBox[] boxes = { Unit, Unit, Unit };
            foreach (float bad in new[] { float.NaN, float.PositiveInfinity, 2 })
            {
                boxes[1].MinY = bad;
                Refused(OspStatus.InvalidBox, () => index.Insert(boxes, ids));
                Expect(index.Count == 0, "nothing of a list with a bad box");
            }
            boxes[1] = Unit;
            Throws<ArgumentException>(() => index.Insert(boxes, new uint[2]));
            index.Insert(boxes, ids);
            index.Insert(new OspBox[0], new uint[0]);
            index.Insert(default(ReadOnlySpan<OspBox>), default(Span<uint>));
            Refused(OspStatus.NotCommitted, () => index.BoxQuery(Unit, room, out count));
            index.Commit();
            Refused(OspStatus.UnknownId, () => index.Remove(3));
            Refused(OspStatus.UnknownId, () => index.Update(Osp.NoId, Unit));
            Refused(OspStatus.UnknownId, () => index.Box(77));
            Throws<ArgumentException>(() => index.Update(ids, new OspBox[2]));
            Throws<ArgumentException>(() => index.Frustum(new float[15], OspDepth.ZeroToOne, room, out count));
            Throws<ArgumentException>(() => index.FrustumOfPlanes(new float[20], room, out count));
            Refused(OspStatus.InvalidView, () => index.Frustum(new float[16], OspDepth.ZeroToOne, room, out count));
            Refused(OspStatus.InvalidArgument, () => index.Frustum(Identity, (OspDepth)7, room, out count));
            Refused(OspStatus.InvalidArgument, () => index.SphereQuery(0, 0, 0, -1, room, out count));
            Refused(OspStatus.InvalidArgument, () => index.Ray(new float[3], new float[3], 1, OspRayMode.Any));
            Expect(index.FrustumOfPlanes(new float[24], room, out count) && count == 3, "no planes, all boxes");
            Expect(!index.Frustum(Identity, OspDepth.ZeroToOne, room.AsSpan(0, 2), out count) && count == 3, "too little room");
            index.Update(new uint[] { 0, 2 }, new[] { new OspBox(5, 5, 5, 6, 6, 6), new OspBox(7, 7, 7, 8, 8, 8) });
            index.Commit();
            Expect(index.BoxQuery(Unit, room, out count) && count == 1 && room[0] == 1, "the one that stayed");
            Expect(index.Memory > 0, "memory");
            index.Clear();
            Expect(index.Count == 0, "nothing");
        }
    }

    static void SceneErrors()
    {
        Refused(OspStatus.InvalidArgument, () => new OspScene(Config((OspOcclusion)9)));
        using (var scene = new OspScene(Config(OspOcclusion.Depth)))
        {
            uint[] ids = new uint[1];
            int count;
            float[] corners = { -1, -1, -3, 1, -1, -3, 0, 1, -3 };
            Throws<ArgumentException>(() => scene.InsertTriangles(new float[8], new uint[0], true, ids));
            Throws<ArgumentException>(() => scene.InsertTriangles(corners, new uint[4], true, ids));
            Refused(OspStatus.InvalidTriangle, () => scene.InsertTriangles(corners, new uint[] { 0, 1, 3 }, true, ids));
            corners[4] = float.NaN;
            Refused(OspStatus.InvalidTriangle, () => scene.InsertTriangles(corners, new uint[0], true, ids));
            corners[4] = -1;
            scene.InsertTriangles(corners, new uint[] { 2, 1, 0 }, true, ids);
            Refused(OspStatus.UnknownId, () => scene.UpdateBox(ids[0], Unit));
            Throws<ArgumentException>(() => scene.Frame(new float[17], OspDepth.ZeroToOne));
            Throws<ArgumentException>(() => scene.Frame(new float[0], OspDepth.ZeroToOne));
            Refused(OspStatus.InvalidArgument, () => scene.Frame(new float[16 * 65], OspDepth.ZeroToOne));
            Refused(OspStatus.InvalidArgument, () => scene.Visible(0, ids, out count));
            scene.Frame(Ahead, OspDepth.MinusOneToOne);
            Refused(OspStatus.InvalidArgument, () => scene.Visible(-1, ids, out count));
            Expect(scene.Visible(0, ids, out count) && count == 1, "one triangle");
            Expect(scene.Memory > 0 && scene.Count == 1, "books");
        }
    }

    static OspSceneConfig Config(OspOcclusion method)
    {
        return new OspSceneConfig {
            Index = new OspIndexConfig { RootSize = 16, Capacity = 256 }, Occlusion = method, DrawNs = 100000 };
    }

    static void Occlusion()
    {
        foreach (OspOcclusion method in new[] { OspOcclusion.Msvbsp, OspOcclusion.Depth, OspOcclusion.DepthLast })
        {
            using (var scene = new OspScene(Config(method)))
            {
                for (int i = 0; i < 100; i++)
                {
                    float x = i % 10 * 0.2f - 1, y = i / 10 * 0.2f - 1;
                    scene.InsertBox(new OspBox(x, y, -6, x + 0.1f, y + 0.1f, -5.9f));
                }
                float[] corners = { -1.9f, -1.9f, -2, 1.9f, -1.9f, -2, 1.9f, 1.9f, -2, -1.9f, 1.9f, -2 };
                uint[] wall = new uint[2], visible = null;
                scene.InsertTriangles(corners, new uint[] { 0, 1, 2, 0, 2, 3 }, true, wall);
                for (int i = 0; i < 4; i++)
                {
                    scene.Frame(Ahead, OspDepth.MinusOneToOne);
                }
                Expect(scene.Visible(0, ref visible) == 2, method + ": the wall alone");
                Expect(visible[0] == wall[0] && visible[1] == wall[1], method + ": the wall");
                scene.Remove(wall[0]);
                scene.Remove(wall[1]);
                OspFrame frame = scene.Frame(Ahead, OspDepth.MinusOneToOne);
                Expect(scene.Visible(0, ref visible) == 100 && frame.InView == 100, method + ": all that it hid");
            }
        }
    }

    static void Threads()
    {
        using (var index = new OspIndex())
        {
            for (int i = 0; i < 100; i++)
            {
                index.Insert(new OspBox(0, 0, -5, i * 0.01f, 1, -4));
            }
            index.Commit();
            int wrong = 0;
            var threads = new Thread[3];
            for (int i = 0; i < threads.Length; i++)
            {
                threads[i] = new Thread(() =>
                {
                    uint[] ids = null;
                    for (int k = 0; k < 200; k++)
                    {
                        if (index.Frustum(Ahead, OspDepth.MinusOneToOne, ref ids) != 100)
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
        var index = new OspIndex();
        index.Dispose();
        index.Dispose();
        Throws<ObjectDisposedException>(() => index.Insert(Unit));
        // Left to the finalizer.
        for (int i = 0; i < 50; i++)
        {
            new OspScene(Config(OspOcclusion.Auto)).InsertBox(Unit);
        }
        GC.Collect();
        GC.WaitForPendingFinalizers();
    }
}
